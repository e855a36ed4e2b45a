"""Sets of manufacturing errors, and equilibria of one train under each of them.

Errors, and the gaps of flanks, are constant data of tooth pairs: a set replaces them in the coupled
train, whose bodies and modes serve all sets. Each set is solved by itself, so that its forces do
not depend on the other sets.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from flexgear.analysis.equilibrium import Equilibrium, revolution
from flexgear.arrays import Array
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import PairData, gap_columns, largest_errors
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

    amplitude m, phase rad (J, M, L), offset m, slope along the face m/m (J, M); gear (J, M, z),
    planet (J, M, z_p) m; runout_amplitude m, runout_phase rad (J, M, H), with the rates and angles
    of the system; gaps: deviations of flank modifications from those of the case, or None.
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


def gear_mesh_forces(
    train: ModalSystem,
    input_angles: Array,
    torque: Array | float,
    sets: ErrorSets,
    look: Callable[[int, Equilibrium], None] | None = None,
) -> Array:
    """Forces (p, M, J) of all flanks, N, at p positions under J sets of errors, which replace those
    of the train; NaN where a set has no equilibrium at some position.

    input_angles (p, F), torque: see ``equilibrium.revolution``; look: called with j and the
    equilibria of set j.
    """
    system = train.system
    force = np.full((len(input_angles), len(system.pairs.s0), len(sets)), np.nan)
    for j in range(len(sets)):
        modal = replace(train, system=system.with_(pairs=sets.pairs(system.pairs, j)))
        try:
            equilibrium = revolution(modal, input_angles, torque)
        except FlexgearError:
            continue  # other sets may have equilibria
        force[:, :, j] = equilibrium.pair_load.sum(axis=-1)
        if look is not None:
            look(j, equilibrium)
    return force
