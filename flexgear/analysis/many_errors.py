"""Equilibria of one train under many sets of manufacturing errors at once.

Errors e enter only the right side of the contact problem of a position (``equilibrium``),

    A x = b(e) + y,   x ≥ 0, y ≥ 0, x·y = 0 on one-sided rows,   y = 0 on all others,

x being pair forces, rigid motions and reactions, y the gaps of unloaded rows times their stiffness.
Let S be what perfect gears load: the flanks that carry and all two-sided rows; B are the others.
A_SS is inverted once for all sets of errors, and with x and y = 0 for the others

    x_S = A_SS⁻¹ b_S(e),   y_B = A_BS x_S − b_B(e).

Where both are ≥ 0, that is the answer. Rows of S that pull are let go by the complementary problem
w = x + Q z, w ≥ 0, z ≥ 0, w·z = 0 among them, Q being rows and columns of A_SS⁻¹; and only where
flanks of B are loaded, too, the whole problem is solved for that set. As A is positive definite but
for the given rotations, the answer is unique: it is that of ``equilibrium.revolution``, but all
flanks are watched at every position. Sums run in the same order for any number of sets, so that a
set's forces do not depend on its company. Bearings with a law of their own are no linear rows: such
trains are solved one set after the other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.equilibrium import Equilibrium, held, port_torques, revolution
from flexgear.analysis.error_sets import ErrorSets, no_errors, waves_of
from flexgear.analysis.kernels.error_positions import forces_under_errors
from flexgear.analysis.kernels.static_position import (
    CLOSURE,
    Held,
    position_work,
)
from flexgear.coupling.kernels.elements import law_functions
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import PairData, rows_of_pair
from flexgear.model.errors import FlexgearError

Array = NDArray[np.float64]
CHUNK = 25  # positions between two reports of progress


@dataclass(frozen=True)
class ErrorStudy:
    """A train with perfect gears at its positions: all that equilibria under errors need.

    input_angles (p, F) independent rotations and theta (p, A) angles of the stages, rad; torques
    (p, P) given on the ports and rated (P,), N·m; held: what the train answers. one_by_one: the
    train itself where it is not linear between contacts.
    """

    pairs: PairData
    input_angles: Array
    theta: Array
    torques: Array
    rated: Array
    held: Held
    one_by_one: ModalSystem | None = None


def error_study(modal: ModalSystem, input_angles: Array, torque: Array | float) -> ErrorStudy:
    """The train at independent rotations (p, F) rad under a torque, as ``revolution`` takes it."""
    system = modal.system
    pairs = no_errors(system.pairs).pairs(system.pairs, 0)
    return ErrorStudy(
        pairs=pairs,
        input_angles=np.asarray(input_angles, dtype=float),
        theta=np.ascontiguousarray(system.theta(input_angles)),
        torques=port_torques(system, torque, len(input_angles)),
        rated=system.rated_port_torques,
        held=held(modal),
        one_by_one=modal if len(pairs.bearing_law) or rows_of_pair(pairs) > 1 else None,
    )


def gear_mesh_forces(
    study: ErrorStudy,
    sets: ErrorSets,
    progress: Callable[[float], None] | None = None,
    look: Callable[[int, Equilibrium], None] | None = None,
) -> Array:
    """Forces (p, M, J) of all gear meshes of one flank, N; NaN where a set has no equilibrium.

    look: gets the equilibria of set j where sets are solved one after the other. Raises
    FlexgearError where perfect gears have none or the inverse closes worse than 1e-8.
    """
    if study.one_by_one is not None:
        return _one_by_one(study, study.one_by_one, sets, progress, look)
    count, laws, waves = len(study.theta), law_functions(study.pairs), waves_of(sets)
    work = position_work(study.pairs, study.held, study.torques.shape[1])
    force = np.zeros((count, len(study.pairs.s0), len(sets)))
    forward = np.ascontiguousarray(study.torques @ study.rated >= 0.0)
    positions = (study.theta, study.torques, forward)
    for start in range(0, count, CHUNK):
        stop = min(start + CHUNK, count)
        at = forces_under_errors(laws, positions, (start, stop), study.held, waves, work, force)
        if at < stop:
            angle = study.input_angles[at, 0]
            raise FlexgearError(
                f"perfect gears have no equilibrium at {angle:.5f} rad that closes "
                f"within {CLOSURE:g} of the load; check torque, bearings and supports"
            )
        if progress is not None:
            progress(stop / count)
    return force


def _one_by_one(
    study: ErrorStudy, modal: ModalSystem, sets: ErrorSets,
    progress: Callable[[float], None] | None, look: Callable[[int, Equilibrium], None] | None,
) -> Array:  # fmt: skip
    force = np.full((len(study.theta), len(study.pairs.s0), len(sets)), np.nan)
    for j in range(len(sets)):
        system = modal.system.with_(pairs=sets.pairs(study.pairs, j))
        try:
            equilibrium = revolution(
                replace(modal, system=system), study.input_angles, study.torques
            )
        except FlexgearError:
            continue  # a set without an equilibrium must not cost the others
        force[:, :, j] = equilibrium.pair_load.sum(axis=-1)
        if look is not None:
            look(j, equilibrium)
        if progress is not None:
            progress((j + 1) / len(sets))
    return force
