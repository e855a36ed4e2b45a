"""Sets of manufacturing errors, and equilibria of one train under many sets at once.

Errors e enter only the right side of the contact problem of a position (``equilibrium``),

    A x = b(e) + y,   x ≥ 0, y ≥ 0, x·y = 0 on one-sided rows,   y = 0 on all others,

x being pair forces, rigid motions and reactions, y the gaps of unloaded rows times their stiffness.
Let S be the rows loaded with perfect gears (the carrying flanks and all two-sided rows), B the
others. A_SS is inverted once for all sets of errors. With x_B = 0 and y_S = 0

    x_S = A_SS⁻¹ b_S(e),   y_B = A_BS x_S − b_B(e),

which is the solution where both are ≥ 0. Rows of S with tension are released by the complementarity
problem w = x + Q z, w ≥ 0, z ≥ 0, w·z = 0, Q being their rows and columns of A_SS⁻¹. Only where
rows of B are loaded, too, the whole problem is solved for that set. As A is positive definite
except for the given rotations, the solution is unique: it is that of ``equilibrium.revolution``
with all flanks active at every position. Sums run in the same order for any number of sets, so that
the forces of a set do not depend on the other sets. Bearings with a law of their own are not linear
rows: such trains are solved for one set after the other.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from flexgear.analysis.equilibrium import Equilibrium, held, port_torques, revolution
from flexgear.analysis.kernels.error_positions import Waves, forces_under_errors
from flexgear.analysis.kernels.static_position import CLOSURE, Held, position_work
from flexgear.arrays import Array
from flexgear.coupling.kernels.elements import law_functions
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import PairData, gap_columns, largest_errors, rows_of_pair
from flexgear.model.errors import FlexgearError


@dataclass(frozen=True)
class GapSets:
    """Gaps of slices of J sets, added to those of the pair data.

    amounts (J, M, B) m: of B kinds of flank modification; factors (2, B, K, T, n), m/m and 1/m:
    gaps of the n slices in the tables of ``PairData`` per amount and per square of the amount.
    """

    amounts: Array
    factors: Array

    def pairs(self, base: PairData, j: int) -> PairData:
        """Pair data with the gaps of set j, with a table of its own for every gear mesh."""
        table, slices = base.table, base.slice_table[base.table]
        for m, count in enumerate(base.slices):
            for power, factor in enumerate(self.factors, 1):
                slices[m, :, gap_columns(count)] += np.tensordot(
                    self.amounts[j, m] ** power, factor[:, table[m], :, :count], axes=1
                )
        return base._replace(
            table=np.arange(len(table), dtype=table.dtype),
            table_start=base.table_start[table],
            table_step=base.table_step[table],
            k_table=base.k_table[table],
            z_table=base.z_table[table],
            gap_table=base.gap_table[table],
            slice_table=slices,
        )


@dataclass(frozen=True)
class ErrorSets:
    """Errors of J sets: axis j, then the axes of the corresponding arrays of ``PairData``.

    amplitude m, phase rad, offset m, slope along the face m/m (J, M); gear (J, M, z), planet
    (J, M, z_p) m; runout_amplitude m, runout_phase rad (J, M, H), with the rates and angles of the
    system; gaps: deviations of flank modifications from those of the case, or None.
    """

    amplitude: Array
    phase: Array
    offset: Array
    slope: Array
    gear: Array
    planet: Array
    runout_amplitude: Array
    runout_phase: Array
    gaps: GapSets | None = None

    def __len__(self) -> int:
        return len(self.offset)

    def pairs(self, base: PairData, j: int) -> PairData:
        """The pair data with the errors of set j."""
        ground = base if self.gaps is None else self.gaps.pairs(base, j)
        pairs = ground._replace(**{of: getattr(self, name)[j] for name, of in _PAIR_DATA.items()})
        return pairs._replace(largest_error=largest_errors(pairs))


# fields of ``PairData`` by those of ``ErrorSets``
_PAIR_DATA = {
    n: n if n.startswith("runout_") else f"error_{n}"
    for n in (field.name for field in fields(ErrorSets))
    if n != "gaps"
}


def no_errors(base: PairData, count: int = 1) -> ErrorSets:
    """``count`` error sets in which all errors are zero."""
    shapes = {name: (count, *getattr(base, field).shape) for name, field in _PAIR_DATA.items()}
    return ErrorSets(**{name: np.zeros(shape) for name, shape in shapes.items()}, gaps=None)


def _waves(sets: ErrorSets) -> Waves:
    """The sets in the form for compiled loops, with axis j last."""

    def sets_last(values: Array) -> Array:
        return np.ascontiguousarray(np.moveaxis(values, 0, -1))

    return Waves(
        sets_last(sets.offset),
        sets_last(sets.slope),
        sets_last(sets.amplitude * np.cos(sets.phase)),
        sets_last(sets.amplitude * np.sin(sets.phase)),
        sets_last(sets.gear),
        sets_last(sets.planet),
        sets_last(sets.runout_amplitude * np.cos(sets.runout_phase)),
        sets_last(sets.runout_amplitude * np.sin(sets.runout_phase)),
    )


CHUNK = 25  # positions of one compiled call, between which the user may interrupt


@dataclass(frozen=True)
class ErrorStudy:
    """A train with perfect gears at p positions, for equilibria under errors.

    input_angles (p, F): independent rotations, rad; theta (p, A): angles of the stages, rad;
    torques (p, P): given torques on the ports, rated (P,): rated ones, N·m; rates (6 B,): motions
    of the blocks in rigid rotation of the train; held: flexibility and rigid motions of the train.
    one_by_one: the train, where its bearings or pairs are not linear; else None.
    """

    pairs: PairData
    input_angles: Array
    theta: Array
    torques: Array
    rated: Array
    rates: Array
    held: Held
    one_by_one: ModalSystem | None = None


def error_study(modal: ModalSystem, input_angles: Array, torque: Array | float) -> ErrorStudy:
    """The train at independent rotations (p, F) rad; torque: see ``equilibrium.revolution``."""
    system = modal.system
    pairs = no_errors(system.pairs).pairs(system.pairs, 0)
    return ErrorStudy(
        pairs=pairs,
        input_angles=np.asarray(input_angles, dtype=float),
        theta=np.ascontiguousarray(system.theta(input_angles)),
        torques=port_torques(system, torque, len(input_angles)),
        rated=system.rated_port_torques,
        rates=system.rolling_rates,
        held=held(modal),
        one_by_one=modal if len(pairs.bearing_law) or rows_of_pair(pairs) > 1 else None,
    )


def gear_mesh_forces(
    study: ErrorStudy,
    sets: ErrorSets,
    look: Callable[[int, Equilibrium], None] | None = None,
) -> Array:
    """Forces (p, M, J) of all flanks, N; NaN where a set has no equilibrium.

    look: called with j and the equilibria of set j where sets are solved one after the other.
    Raises FlexgearError where perfect gears have no equilibrium that closes within 1e-8.
    """
    if study.one_by_one is not None:
        return _one_by_one(study, study.one_by_one, sets, look)
    count, laws, waves = len(study.theta), law_functions(study.pairs), _waves(sets)
    work = position_work(study.pairs, study.held, study.torques.shape[1], study.rates)
    force = np.zeros((count, len(study.pairs.s0), len(sets)))
    forward = np.ascontiguousarray(study.torques @ study.rated >= 0.0)
    positions = (study.theta, study.torques, forward)
    for start in range(0, count, CHUNK):
        stop = min(start + CHUNK, count)
        p = forces_under_errors(laws, positions, (start, stop), study.held, waves, work, force)
        if p < stop:
            angle = study.input_angles[p, 0]
            raise FlexgearError(
                f"perfect gears have no equilibrium at {angle:.5f} rad that closes "
                f"within {CLOSURE:g} of the load; check torque, bearings and supports"
            )
    return force


def _one_by_one(
    study: ErrorStudy, modal: ModalSystem, sets: ErrorSets,
    look: Callable[[int, Equilibrium], None] | None,
) -> Array:  # fmt: skip
    force = np.full((len(study.theta), len(study.pairs.s0), len(sets)), np.nan)
    for j in range(len(sets)):
        system = modal.system.with_(pairs=sets.pairs(study.pairs, j))
        try:
            equilibrium = revolution(
                replace(modal, system=system), study.input_angles, study.torques
            )
        except FlexgearError:
            continue  # other sets may have equilibria
        force[:, :, j] = equilibrium.pair_load.sum(axis=-1)
        if look is not None:
            look(j, equilibrium)
    return force
