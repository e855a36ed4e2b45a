"""Ring and carrier of a case as reduced bodies: FE mesh, matrices, reduction, errors, cache."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.geometry import stage_geometry
from flexgear.model.carrier import Carrier
from flexgear.model.errors import InputError
from flexgear.model.ring import Ring
from flexgear.model.ring_supports import ring_supports as ring_held
from flexgear.model.stage_view import StageView
from flexgear.structures import estimate, probe_loads
from flexgear.structures.cyclic.path import sector_counts
from flexgear.structures.fe_mesh import (
    CarrierMeshParameters,
    FeMesh,
    Groups,
    RingMeshParameters,
    carrier_groups,
    carrier_of_case,
    ring_groups,
    ring_of_case,
)
from flexgear.structures.fem import Interface
from flexgear.structures.fem.unassembled import UnassembledModel
from flexgear.structures.given import given_carrier, given_ring
from flexgear.structures.interfaces import (
    carrier_interface,
    carrier_supports,
    ring_interface,
    ring_supports,
)
from flexgear.structures.linalg.threads import single_threaded_blas
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.reduction import (
    AnyCondensation,
    Progress,
    condense,
    reduce,
    silent,
)
from flexgear.structures.store import cached, content_key, is_kept

_JUDGED = 0.5  # of the highest fixed-interface frequency: to where reduced bodies are compared
_PROBED_TEETH = 12  # teeth whose flanks the static error estimate loads


def require_file(view: StageView, part: str) -> None:
    """InputError for what the file of "ring" or "carrier", FE mesh or matrices, is refused for.

    An FE mesh whose reduced body is kept was in place when that was made: the key says for what.
    """
    reduced, key, fe_mesh = {
        "ring": (given_ring, ring_key, ring_of_case),
        "carrier": (given_carrier, _carrier_key, carrier_of_case),
    }[part]
    if getattr(view, part).fe_mesh == "reduced":
        reduced(view)
    elif not is_kept(key(view)):
        fe_mesh(view)


def ring_body(
    view: StageView, progress: Progress | None = None, limit_hz: float | None = None
) -> ReducedBody:
    """The case's ring gear, reduced; from the cache if it was reduced before.

    limit_hz: up to which its frequencies are judged; all that were compared where neither this nor
    the case says so. One that is given reduced is taken as it is, without error estimates.
    """
    if view.ring.fe_mesh == "reduced":
        return given_ring(view)
    report = progress or silent
    body = cached(ring_key(view), lambda: _reduce_ring(view, report))
    return _judged(body, ring_supports(view, body), limit_hz or view.solver.reduction_limit)


def ring_condensed(
    view: StageView, progress: Progress = silent
) -> tuple[UnassembledModel, AnyCondensation]:
    """The unreduced ring and its condensation on its nodes, made anew."""
    model = _model(view, ring_of_case(view))
    sectors = _sectors(view, view.ring_gear.teeth)
    with single_threaded_blas():
        return model, condense(model, ring_interface(view, model), progress, sectors)


def ring_key(view: StageView) -> str:
    """Of the content that the reduced ring depends on."""
    ring = view.ring
    return content_key(
        body="ring",
        fe_mesh=_mesh_content(view, ring, RingMeshParameters, ring_groups),
        material=view.material.model_dump(),
        ties=[ring.tie, ring.tie_kind],
        supports=[
            [s.node, s.group, s.place, s.end, s.diameter]
            for s in ring_held(ring, view.stage.face_width)
        ],
        teeth=[view.ring_gear.teeth, stage_geometry(view).ring.reference_radius],
        modes=ring.fixed_interface_modes,
        cyclic=view.solver.cyclic,
        limit=view.solver.reduction_limit,
    )


def carrier_body(
    view: StageView, progress: Progress | None = None, limit_hz: float | None = None
) -> ReducedBody:
    """The case's planet carrier, reduced; from the cache if it was reduced before."""
    if view.carrier.fe_mesh == "reduced":
        return given_carrier(view)
    report = progress or silent
    body = cached(_carrier_key(view), lambda: _reduce_carrier(view, report))
    at = slice(0, body.interface_dofs)
    supports = carrier_supports(view, body, body.stiffness[at, at])
    return _judged(body, supports, limit_hz or view.solver.reduction_limit)


def _carrier_key(view: StageView) -> str:
    return content_key(
        body="carrier",
        ties="seats of pins",
        fe_mesh=_mesh_content(view, view.carrier, CarrierMeshParameters, carrier_groups),
        material=view.material.model_dump(),
        pins=[list(view.stage.planet_angles), stage_geometry(view).center_distance],
        modes=view.carrier.fixed_interface_modes,
        cyclic=view.solver.cyclic,
        limit=view.solver.reduction_limit,
    )


def _reduce_ring(view: StageView, progress: Progress) -> ReducedBody:
    ring, teeth, width = view.ring, view.ring_gear.teeth, view.stage.face_width
    clock = _Clock()
    progress("ring: FE mesh", 0.0)
    fe_mesh = ring_of_case(view)
    clock.lap("fe_mesh")
    model = _model(view, fe_mesh)
    interface = ring_interface(view, model)
    clock.lap("ties")
    supports = ring_supports(view, interface)
    flank = all(f"tooth_flank_{j + 1:03d}" in fe_mesh.facets for j in range(teeth))
    probed = sorted({k * teeth // _PROBED_TEETH for k in range(_PROBED_TEETH)})
    loads = probe_loads.tooth_lines(model, probed, width) if flank else []
    clock.lap("probe_loads")
    body = _Unreduced("ring", model, interface, loads, _sectors(view, teeth))
    modes, limit = ring.fixed_interface_modes, view.solver.reduction_limit
    return _reduced(
        *(body, modes, lambda _: supports, limit, clock, progress),
        tie=ring.tie,
        tie_kind=ring.tie_kind,
        fidelity=view.solver.fidelity,
    )


def _reduce_carrier(view: StageView, progress: Progress) -> ReducedBody:
    clock = _Clock()
    progress("carrier: FE mesh", 0.0)
    fe_mesh = carrier_of_case(view)
    clock.lap("fe_mesh")
    model = _model(view, fe_mesh)
    interface = carrier_interface(view, model)
    angles = np.asarray(view.stage.planet_angles)
    clock.lap("ties")
    loads = probe_loads.pin_pressures(model, len(angles), angles)
    clock.lap("probe_loads")
    body = _Unreduced("carrier", model, interface, loads, _sectors(view, len(angles)))
    modes, limit = view.carrier.fixed_interface_modes, view.solver.reduction_limit
    return _reduced(
        body,
        modes,
        lambda stiffness: carrier_supports(view, interface, stiffness),
        *(limit, clock, progress),
        tie="surface",
        tie_kind="seats of pins",
        fidelity=view.solver.fidelity,
    )


@dataclass(frozen=True, eq=False)
class _Unreduced:
    """A body with its ties and the loads of its static check."""

    name: str
    model: UnassembledModel
    interface: Interface
    loads: Sequence[probe_loads.ProbeLoad]
    sectors: tuple[int, ...]


def _reduced(
    unreduced: _Unreduced,
    modes: int,
    supports_on: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    wanted_hz: float | None,
    clock: _Clock,
    progress: Progress,
    **options: Any,
) -> ReducedBody:
    """The reduced body with the loads of its static check, frequency estimates in the report.

    supports_on: K_bb -> S. Frequencies are compared up to half the highest fixed-interface one,
    beyond which that basis is not made for, or to wanted_hz if that is higher.
    """
    reduction = reduce(
        *(unreduced.model, unreduced.interface, modes),
        *(progress, unreduced.name, unreduced.sectors),
    )
    clock.lap("reduction")
    progress("static check", 0.0)
    highest = float(reduction.body.report.get("fixed_interface_frequency_max_hz") or 0.0)
    limit = max(_JUDGED * highest, wanted_hz or 0.0)
    supports = supports_on(reduction.condensation.stiffness)
    with single_threaded_blas():
        body = estimate.probed(reduction, unreduced.loads)
        frequencies = estimate.compare_frequencies(reduction, supports, limit, progress)
    clock.lap("estimates")
    report = {
        **body.report,
        **options,
        "supports_key": content_key(supports=supports),
        "static_end_share": probe_loads.END_SHARE,
        "compared_to_hz": max(limit, float(frequencies.full[-1])),
        "compared_frequencies_hz": frequencies.full.tolist(),
        "compared_errors": frequencies.errors.tolist(),
        "seconds": clock.laps,
    }
    return body.with_(report=report)


def _model(view: StageView, fe_mesh: FeMesh) -> UnassembledModel:
    """The body; what its matrices are wanted for decides how much of them is assembled."""
    m = view.material
    return UnassembledModel(fe_mesh, m.young_modulus, m.poisson_ratio, m.density)


def _sectors(view: StageView, repeats: int) -> tuple[int, ...]:
    """Numbers of sectors to try for a body with so many teeth or pins."""
    return sector_counts(repeats) if view.solver.cyclic == "auto" else ()


def _judged(
    body: ReducedBody, supports: NDArray[np.float64], limit_hz: float | None
) -> ReducedBody:
    """The body with its static errors on these supports, and its frequency error up to limit_hz
    (of the lowest mode where none lies below), in the report.

    Supports are not part of the cache's key: other bolts or bearings need no new reduction. The
    report says whether the frequency estimate, which needs one, stood on these supports.
    """
    with single_threaded_blas():
        static = estimate.static_errors(body, supports)
    compared = body.report["compared_to_hz"]
    limit = compared if limit_hz is None else min(limit_hz, compared)
    frequencies = np.array(body.report["compared_frequencies_hz"])
    below = int(np.searchsorted(frequencies, limit, side="right"))
    judged = {
        "frequency_error": max(body.report["compared_errors"][: max(below, 1)]),
        "frequency_limit_hz": limit,
        "frequencies_below_limit": below,
        "supported_frequency_min_hz": float(frequencies[0]),
        **estimate.worst(static),
        "static_error_cases": static,
        "frequency_error_on_these_supports": (
            body.report["supports_key"] == content_key(supports=supports)
        ),
    }
    return body.with_(report={**body.report, **judged})


class _Clock:
    """Wall time of stages, s."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.laps[name], self._last = now - self._last, now


def _mesh_content(
    view: StageView,
    part: Ring | Carrier,
    generator: type[RingMeshParameters] | type[CarrierMeshParameters],
    groups: Callable[[StageView], Groups],
) -> object:
    """What a mesh depends on: the generator's parameters, or the bytes of the user's file, where
    it is put, and what its place was judged by."""
    if part.fe_mesh == "generate" or part.fe_mesh_file is None:
        return replace(generator.from_case(view), where="")  # the case's path changes nothing
    file = part.fe_mesh_file
    try:
        digest = hashlib.sha256(Path(file).read_bytes()).hexdigest()
    except OSError as error:
        raise InputError(
            "case", "fe_mesh_file", f"{file}: {error.strerror}", "check the path"
        ) from None
    put = [part.fe_mesh_unit, part.fe_mesh_shift, part.fe_mesh_turn]
    return ["file", digest, put, groups(view).content()]
