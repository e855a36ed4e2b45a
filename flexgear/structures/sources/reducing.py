"""Ties of a body's nodes, its reduction, and the errors of that."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flexgear.arrays import Array
from flexgear.structures import estimate
from flexgear.structures.cache import content_key
from flexgear.structures.cyclic.condensation import sector_counts
from flexgear.structures.fem.assembly import FeModel, disc_points, facet_sample, point_sample
from flexgear.structures.fem.ties import (
    Interface,
    Tie,
    averaging_tie,
    interface_of,
    rigid_tie,
    seat_tie,
)
from flexgear.structures.frequency_check import compare_frequencies
from flexgear.structures.linalg.dense import single_threaded_blas
from flexgear.structures.reduced import Progress, ReducedBody, silent
from flexgear.structures.reduction import AnyCondensation, condense, with_modes

if TYPE_CHECKING:
    from flexgear.structures.sources.fe_body import FeBody, TiedNode

_TIES = {"averaging": averaging_tie, "rigid": rigid_tie, "seat": seat_tie}
_COMPARED = 0.5  # limit of compared frequencies over the highest fixed-interface frequency


def tied(model: FeModel, nodes: Sequence[TiedNode]) -> Interface:
    """Interface of nodes that are tied to surfaces of a model."""
    ties: list[Tie] = []
    for node in nodes:
        if node.patch:
            sample = facet_sample(model, model.fe_mesh.facets[node.patch])
        else:
            outward = (np.cos(node.angle), np.sin(node.angle), 0.0)
            sample = point_sample(model, *disc_points(node.place, node.diameter, outward))
        ties.append(_TIES[node.tie](node.name, node.place, sample))
    return interface_of(model, ties)


@dataclass(frozen=True, eq=False)
class Unreduced:
    """An FE body before its modes are chosen.

    condensation: static condensation on its interface nodes; loads: load cases for the estimate of
    its static error; seconds: computing time.
    """

    model: FeModel
    condensation: AnyCondensation
    loads: Sequence[estimate.ProbeLoad]
    seconds: float


def unreduced_body(source: FeBody, progress: Progress = silent) -> Unreduced:
    """The FE mesh of a source, its matrices, and its condensation on its nodes."""
    start = time.perf_counter()
    progress(f"{source.key.part}: FE mesh", 0.0)
    fe_mesh = source.fe_mesh()
    model = FeModel.of(fe_mesh, source.material)
    interface = tied(model, source.nodes(fe_mesh))
    loads = source.probe_loads(model)
    sectors = sector_counts(source.repeats) if source.cyclic else ()
    with single_threaded_blas():
        condensation = condense(model, interface, progress, sectors)
    return Unreduced(model, condensation, loads, time.perf_counter() - start)


def reduced_body(source: FeBody, unreduced: Unreduced, progress: Progress) -> ReducedBody:
    """The reduced body of a source, with the loads of its static error estimate, and with frequency
    errors in its report.

    Frequencies are compared up to half the highest fixed-interface frequency, beyond which the
    basis is not accurate, or up to ``limit_hz`` where that is higher.
    """
    start = time.perf_counter()
    name, interface = source.key.part, unreduced.condensation.interface
    reduction = with_modes(unreduced.model, unreduced.condensation, source.modes, progress, name)
    progress("static check", 0.0)
    highest = float(reduction.body.report["fixed_interface_frequency_max_hz"] or 0.0)
    limit = max(_COMPARED * highest, source.limit_hz or 0.0)
    supports = source.supports(interface.node_names, reduction.condensation.stiffness)
    with single_threaded_blas():
        body = estimate.with_probe_loads(reduction, unreduced.loads)
        frequencies = compare_frequencies(reduction, supports, limit, progress)
    tie, tie_kind = source.ties
    report = {
        **body.report,
        "tie": tie,
        "tie_kind": tie_kind,
        "fidelity": source.parameters.fidelity,
        "supports_key": content_key(supports=supports),
        "static_end_share": estimate.END_SHARE,
        "compared_to_hz": max(limit, float(frequencies.full[-1])),
        "compared_frequencies_hz": frequencies.full.tolist(),
        "compared_errors": frequencies.errors.tolist(),
        "seconds": {
            "condensation": unreduced.seconds,
            "modes_and_errors": time.perf_counter() - start,
        },
    }
    return body.with_(report=report)


def accurate_to(body: ReducedBody) -> float:
    """Highest frequency, Hz, below which all natural frequencies of the reduced body were compared
    with those of the unreduced one and differ by at most ``PROMISED``."""
    errors = np.array(body.report["compared_errors"])
    wrong = np.array(body.report["compared_frequencies_hz"])[errors > estimate.PROMISED]
    return float(min([body.report["compared_to_hz"], *wrong]))


def with_errors(body: ReducedBody, supports: Array, limit_hz: float | None) -> ReducedBody:
    """The body with its static errors on these supports, and its frequency error up to limit_hz
    (that of the lowest mode where no mode is below), in the report.

    Supports are not part of the cache key: other bolts or bearings need no new reduction. The
    frequency error does need one; ``frequency_error_on_these_supports`` of the report states
    whether it is of these supports.
    """
    with single_threaded_blas():
        static = estimate.static_errors(body, supports)
    compared = body.report["compared_to_hz"]
    limit = compared if limit_hz is None else min(limit_hz, compared)
    frequencies = np.array(body.report["compared_frequencies_hz"])
    below = int(np.searchsorted(frequencies, limit, side="right"))
    errors = {
        "frequency_error": max(body.report["compared_errors"][: max(below, 1)]),
        "frequency_limit_hz": limit,
        "frequencies_below_limit": below,
        "supported_frequency_min_hz": float(frequencies[0]),
        **estimate.largest_error(static),
        "static_error_cases": static,
        "frequency_error_on_these_supports": (
            body.report["supports_key"] == content_key(supports=supports)
        ),
    }
    return body.with_(report={**body.report, **errors})
