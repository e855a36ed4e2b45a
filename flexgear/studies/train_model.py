"""Coupled systems of a train, made once and shared by all runs over it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.modal import ModalSystem, chosen_modal
from flexgear.coupling.pace import train_pace
from flexgear.coupling.system import System, Variant
from flexgear.coupling.train import train_system
from flexgear.model.case import Case
from flexgear.structures.reduced import ReducedBody
from flexgear.studies.stage_bodies import Progress, named, silent, stage_bodies, variant_of

Array = NDArray[np.float64]
Bodies = Mapping[str, tuple[ReducedBody, ReducedBody]]
RIGID = Variant(False, False, False)


def flexible_stages(train: Case) -> tuple[str, ...]:
    """Names of the stages whose ring and carrier are finite-element bodies."""
    return tuple(s.name for s in train.stages if s.flexible is not None)


def train_bodies(train: Case, progress: Progress = silent) -> Bodies:
    """Reduced ring and carrier of every flexible stage by its name, from the cache where known."""
    found = {}
    for stage in train.stages:
        if stage.flexible is not None:
            made = stage_bodies(stage.flexible, named(stage.name, progress))
            found[stage.name] = (made.ring, made.carrier)
    return found


def train_variants(train: Case, rigid: tuple[str, ...] = ()) -> dict[str, Variant]:
    """Which components of the flexible stages bend: their own choice, less those named rigid."""
    return {s.name: variant_of(s.flexible, rigid) for s in train.stages if s.flexible is not None}


def variant_label(variants: Mapping[str, Variant]) -> str:
    """ "lumped" without flexible stages, else what bends in them."""
    labels = {v.label for v in variants.values()}
    if not labels:
        return "lumped"
    if len(labels) == 1:
        return labels.pop()
    return ", ".join(f"{name}: {v.label}" for name, v in variants.items())


def coupled_train(
    train: Case,
    progress: Progress = silent,
    *,
    bodies: Bodies | None = None,
    variants: Mapping[str, Variant] | None = None,
) -> System:
    """The train as one system.

    bodies: of flexible stages, made (or read from the cache) if not given; variants: which of
    their components bend, their own choice if not given.
    """
    reduced = train_bodies(train, progress) if bodies is None else bodies
    return train_system(train, reduced, train_variants(train) if variants is None else variants)


def train_modal(
    train: Case,
    progress: Progress = silent,
    *,
    bodies: Bodies | None = None,
    variants: Mapping[str, Variant] | None = None,
) -> ModalSystem:
    """``coupled_train`` in the modes that ``solver`` asks for; InputError without load."""
    train.require_load()
    system = coupled_train(train, progress, bodies=bodies, variants=variants)
    return chosen_modal(system, train_pace(train))


def without_errors(modal: ModalSystem) -> ModalSystem:
    """The same modal system with perfect gears: errors enter no matrix, only the gear meshes."""
    errors = [name for name in modal.system.pairs._fields if name.startswith("error_")]
    zero = {n: np.zeros_like(getattr(modal.system.pairs, n)) for n in errors}
    pairs = modal.system.pairs
    clean = pairs._replace(
        **zero,
        runout_amplitude=np.zeros_like(pairs.runout_amplitude),
        largest_error=np.zeros_like(pairs.largest_error),
    )
    return replace(modal, system=modal.system.with_(pairs=clean))


def rated_rotations(system: System, lead: Array) -> Array:
    """Independent rotations (p, F) of the train rolling at rated speeds, rad.

    lead: (p,) rotation of the first of them that turns, forward in time where it rises; of the
    first one alone where none turns.
    """
    speeds = system.rated_master_speeds
    first = next((abs(w) for w in speeds if w != 0), 0.0)
    rates = speeds / first if first else np.eye(1, len(speeds))[0]
    return np.multiply.outer(np.asarray(lead, dtype=float), rates)
