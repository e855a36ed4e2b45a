"""Sets of manufacturing errors of all gear meshes of a system, one beside the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.kernels.error_positions import Waves
from flexgear.coupling.pair_data import PairData, gap_columns

Array = NDArray[np.float64]


@dataclass(frozen=True)
class GapSets:
    """Gaps of slices of J sets beside those of the pair data.

    amounts: (J, M, B) m of B ways to grind flanks; factors: (2, B, K, T, n) of an amount and of its
    square, m/m and 1/m, in what it adds to
    the gaps of the n slices in the tables of ``PairData``.
    """

    amounts: Array
    factors: Array

    def pairs(self, base: PairData, j: int) -> PairData:
        """Pair data with a table for every gear mesh, as planets differ."""
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
    """Errors of J sets in the places of ``PairData``: first axis j, then as there.

    amplitude m, phase rad, offset m, slope along the face m/m (J, M); gear (J, M, z), planet (J, M,
    z_p) m; runout_amplitude m, runout_phase rad (J, M, H), their rates and angles are those of the
    system. gaps: of flanks that are ground otherwise than the case says, if any are.
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
        gear, planet, runout = self.gear[j], self.planet[j], self.runout_amplitude[j]
        largest = self.offset[j] + np.abs(self.amplitude[j]) + np.abs(runout).sum(axis=1)
        largest = largest + np.abs(self.slope[j]) * base.half_face
        ground = base if self.gaps is None else self.gaps.pairs(base, j)
        return ground._replace(
            error_amplitude=self.amplitude[j],
            error_phase=self.phase[j],
            error_offset=self.offset[j],
            error_slope=self.slope[j],
            error_gear=gear,
            error_planet=planet,
            runout_amplitude=runout,
            runout_phase=self.runout_phase[j],
            largest_error=largest + np.abs(gear).max(axis=1) + np.abs(planet).max(axis=1),
        )


def no_errors(base: PairData) -> ErrorSets:
    """One set without errors."""
    return ErrorSets(
        amplitude=np.zeros((1, *base.error_amplitude.shape)),
        phase=np.zeros((1, *base.error_phase.shape)),
        offset=np.zeros((1, *base.error_offset.shape)),
        slope=np.zeros((1, *base.error_slope.shape)),
        gear=np.zeros((1, *base.error_gear.shape)),
        planet=np.zeros((1, *base.error_planet.shape)),
        runout_amplitude=np.zeros((1, *base.runout_amplitude.shape)),
        runout_phase=np.zeros((1, *base.runout_phase.shape)),
    )


def waves_of(sets: ErrorSets) -> Waves:
    """The sets as the compiled loops read them."""

    def last(values: Array) -> Array:
        return np.ascontiguousarray(np.moveaxis(values, 0, -1))

    return Waves(
        last(sets.offset),
        last(sets.slope),
        last(sets.amplitude * np.cos(sets.phase)),
        last(sets.amplitude * np.sin(sets.phase)),
        last(sets.gear),
        last(sets.planet),
        last(sets.runout_amplitude * np.cos(sets.runout_phase)),
        last(sets.runout_amplitude * np.sin(sets.runout_phase)),
    )
