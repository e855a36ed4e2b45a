"""The direct path: rating of flanks and roots by computed pressure and root stress.

Every place of a tooth is compared with the life curve of the whole tooth in the standard
(ISO 6336-2, -3, -5, -6). The stress is the Hertzian pressure of the slice times √(K_A K_v), or the
FE stress in the fillet times K_A K_v, as equilibria contain neither factor. The passes
(``solve.stresses``) of a gear occur in turn, so each counts for an equal share of the cycles; a
tooth of a stationary ring is passed by every planet at its own azimuth. A comparison of an FE notch
stress with σ_Flim Y_ST is outside the standard, whose strengths belong to stresses by its formulas.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.nominal_stress import contact_line_factor
from flexgear.gears.rating.capacity import Limit, LimitState, mean_stress_influence
from flexgear.gears.rating.damage import LifeCurve, Places, around_axis, pulsating_stress
from flexgear.gears.rating.pair import GearPair
from flexgear.gears.rating.sheet import Sheet, sheet_of, value_of
from flexgear.model.names import GroupName
from flexgear.solve.bin_loads import EQUAL_LOAD, BinLoads, SpectrumTrain, roots_in_bin
from flexgear.solve.stresses import GroupStresses

OTHER = {"sun": "ring", "ring": "sun"}


class PathOrReason(NamedTuple):
    """A direct path, or None and the reason why there is none: "" where stresses or strengths of a
    load bin are unknown."""

    path: DirectPath | None
    reason: str = ""


class LoadedState(NamedTuple):
    """A flank or root in one load bin.

    factors: load factors; cycles: number of load cycles; at: load cycles at which the bin alone is
    rated; group, part: group of the loading gear meshes and the part of the gear in them; planet:
    number (from 1) of the planet with these factors, 0 where all planets are loaded alike.
    """

    state: LimitState
    factors: Sheet
    cycles: float
    at: float
    group: GroupName
    part: str
    planet: int


def direct_path(
    trains: Sequence[SpectrumTrain],
    pair: GearPair,
    kind: Limit,
    history: Mapping[int, LoadedState],
    loads: Sequence[BinLoads],
) -> PathOrReason:
    """Direct path of one flank or root over all bins; trains: the solved trains of ``loads``."""
    first = next(iter(history.values()))
    of_bins = {b: loads[b].groups[x.group].stresses for b, x in history.items()}
    stresses = {b: s for b, s in of_bins.items() if s and (kind == "flank" or s.tension.size)}
    states = {b: x.state for b, x in history.items()}
    curves = {
        # divided by the mean stress factor that the direct path applies to the stress
        b: replace(c, stress=tuple(s / _computed_factor(pair, history[b]) for s in c.stress))
        for b, state in states.items()
        if (c := state.curve) is not None
    }
    if not len(stresses) == len(curves) == len(history):
        return PathOrReason(None)
    if len({x.group.kind for x in history.values()}) > 1:
        reason = (
            "load cases of both senses load it at sun and ring in turn, which it does not count"
        )
        return PathOrReason(None, reason)
    influence = 0.0 if kind == "flank" else mean_stress_influence(pair.gears[first.part])
    path = DirectPath(trains, pair, kind, history, loads, stresses, curves, influence)
    return PathOrReason(path)


def _computed_factor(pair: GearPair, loaded: LoadedState) -> float:
    """Mean stress factor Y_M of the standard by which the direct path has to be divided: that of
    idlers, whose stress it computes under loads on both flanks; 1 of other gears."""
    idler = pair.gears[loaded.part].idler
    return value_of(loaded.state.factors, "Y_M", 1.0) if idler else 1.0


@dataclass(frozen=True)
class DirectPath:
    """Direct path of one flank or root over all bins. pair: its gear mesh; stresses, curves:
    computed stresses and life curve by bin; influence: of the mean stress, (1 − M)/(1 + M)."""

    trains: Sequence[SpectrumTrain]
    pair: GearPair
    kind: Limit
    history: Mapping[int, LoadedState]
    loads: Sequence[BinLoads]
    stresses: Mapping[int, GroupStresses]
    curves: Mapping[int, LifeCurve]
    influence: float

    @property
    def _part(self) -> str:
        return next(iter(self.history.values())).part

    @property
    def _is_stationary(self) -> bool:
        """Whether every tooth stays at its azimuth (a stationary ring)."""
        group = next(iter(self.history.values())).group
        return self._part == "ring" and f"{group.stage}.ring" in self.trains[0].case.held_members()

    def _maps(self, b: int) -> tuple[Array, Array]:
        """Largest and least stress (passes, teeth, places …), Pa, in a bin; the least stress is 0
        where compression does not count."""
        loaded, of = self.history[b], self.stresses[b]
        factor = math.prod(loaded.factors[symbol].value for symbol in ("K_A", "K_v"))
        if self.kind == "flank":
            largest, least = math.sqrt(factor) * of.pressure, np.zeros((1, 1))
        else:
            member = 0 if loaded.part == "planet" else 1
            largest, least = factor * of.tension[:, :, member], factor * of.lowest[:, None]
        least = least if least.size else np.zeros((1, 1))
        if loaded.part == "planet":  # passes are gear-mesh cycles, teeth are planets
            return largest.swapaxes(0, 1), factor * self._pressed(b).swapaxes(0, 1)
        if self._is_stationary:
            teeth = self.pair.gears["ring"].teeth
            at = 2.0 * math.pi * np.arange(teeth) / teeth
            passes = zip(of.azimuth, largest, strict=True)
            return np.stack([around_axis(angle, x, at) for angle, x in passes]), least
        return largest.reshape(-1, 1, *largest.shape[2:]), least.min(axis=0, keepdims=True)

    def _pressed(self, b: int) -> Array:
        """Compressive stress (N, C, F), Pa, in the fillets of the N planets over C cycles and F
        places along the face, from the load on the other flank; zero (1, 1) without such a load."""
        group = self.history[b].group
        other = GroupName.of(group.stage, OTHER[group.role], group.side)
        opposite = self.loads[b].groups.get(other)
        if self.kind == "flank" or opposite is None or opposite.stresses is None:
            return np.zeros((1, 1))
        return opposite.stresses.compression[:, :, 0]

    def stress(self, b: int) -> Array:
        """Equivalent stress (passes, teeth, places …), Pa, in a bin."""
        return pulsating_stress(*self._maps(b), self.influence)

    @cached_property
    def _lasting(self) -> list[int]:
        """Bins with a duration and load cycles, whose damages add up; each other bin is rated
        alone."""
        bins = self.trains[0].bins
        return [b for b, x in self.history.items() if bins[b].hours > 0.0 and x.cycles > 0.0]

    @cached_property
    def _places(self) -> Places:
        """Damage accumulation of every place under the bins with a duration."""
        return Places(
            lambda k: self._flat(self._lasting[k]),
            tuple(self.curves[b] for b in self._lasting),
            np.array([self.history[b].cycles for b in self._lasting]),
        )

    @cached_property
    def _weakest(self) -> tuple[Array, Array, Array]:
        """Safety (teeth,) of every tooth, index of its weakest place, and number of the bin that
        governs alone, −1 where the bins with a duration together govern. The safety is that under
        all bins with a duration or in one other bin, where it is least over the required one."""
        alone = [b for b in self.history if b not in self._lasting]
        teeth, each = self.stress(next(iter(self.history))).shape[1], []
        if self._lasting:
            each.append((*self._places.weakest(teeth), -1))
        for b in alone:
            stress = self._flat(b).max(axis=0).reshape(teeth, -1)
            place = np.arange(teeth) * stress.shape[1] + stress.argmax(axis=1)
            strength = self.curves[b].stress_at(self.history[b].at)
            with np.errstate(divide="ignore"):
                each.append((place, strength / stress.max(axis=1), b))
        place, safety = (np.array([x[k] for x in each]) for k in range(2))
        required = np.array([self._required(b) for *_, b in each])
        first, tooth = (safety / required[:, None]).argmin(axis=0), np.arange(teeth)
        return safety[first, tooth], place[first, tooth], np.array([x[2] for x in each])[first]

    def _required(self, b: int) -> float:
        """Required safety in a bin; −1: under the bins with a duration."""
        return self.history[self._lasting[0] if b < 0 else b].state.least_safety

    @property
    def safety_of_teeth(self) -> Array:
        """Safety (z,) of the teeth of a stationary ring by azimuth; empty for other gears."""
        return self._weakest[0] if self._is_stationary else np.zeros(0)

    def sheet(self) -> Sheet:
        """Safety, damage, life, the weakest place, and the causes of the difference from the
        standard."""
        required = np.array([self._required(b) for b in self._weakest[2]])
        tooth, sums = int(np.argmin(self._weakest[0] / required)), {}
        safety, place, worst = (x[tooth] for x in self._weakest)
        least = {f"S_{'H' if self.kind == 'flank' else 'F'}min": required[tooth]}
        if worst < 0:
            worst = max(self._lasting, key=lambda b: float(self._flat(b)[:, place].max()))
        if self._lasting:
            damage = float(self._places.damage().max())
            hours = sum(load_bin.hours for load_bin in self.trains[0].bins)
            sums = {"D_direct": damage, "L_direct": hours / damage if damage else math.inf}
        at = self._where(int(worst), int(place))
        lines = {"S_direct": safety, **least, **sums, **at, **self._against_standard(int(worst))}
        return sheet_of(lines)

    def _flat(self, b: int) -> Array:
        """``stress`` as (passes, places), Pa."""
        stress = self.stress(b)
        return stress.reshape(len(stress), -1)

    def _where(self, b: int, place: int) -> dict[str, float]:
        """Position of a place on the tooth (s/g, z/b), and azimuth φ of the tooth, deg, or number
        of the planet where planets differ."""
        shape = self.stress(b).shape[1:]
        tooth, *at = np.unravel_index(place, shape)
        if self.kind == "flank":
            values = {"s/g": (at[0] + 0.5) / shape[1], "z/b": (at[1] + 0.5) / shape[2] - 0.5}
        else:
            values = {"z/b": at[0] / (shape[1] - 1) - 0.5}
        if self._is_stationary:
            values["φ"] = 360.0 * float(tooth) / shape[0]
        elif self._part == "planet" and max(of := self._weakest[0]) > (1.0 + EQUAL_LOAD) * min(of):
            values["planet"] = float(tooth) + 1.0
        return values

    def _against_standard(self, b: int) -> dict[str, float]:
        """Ratio of the largest stress in a bin to that of the standard, and its factors."""
        loaded, stress = self.history[b], self.stress(b)
        at = np.unravel_index(int(np.argmax(stress)), stress.shape)
        largest = float(stress[at])
        ratio = largest * _computed_factor(self.pair, loaded) / loaded.state.stress
        causes = self._of_flank(b, at, ratio) if self.kind == "flank" else self._of_root(b, at)
        return {"σ_direct": largest / 1e6, "σ_direct/σ": ratio, **causes}

    def _of_flank(self, b: int, at: Sequence[np.intp], ratio: float) -> dict[str, float]:
        """Factors of a pressure ratio: that of the curvature at the largest pressure over Z_B (Z_D)
        and Z_β, and the remainder, that of the load distribution."""
        factors = self.history[b].state.factors
        place = float(self.stresses[b].path[at[2]]) - self.pair.gears["planet"].roll_length
        radii = self.pair.relative_curvature() / self.pair.relative_curvature(place)
        norm = math.prod(value_of(factors, symbol, 1.0) for symbol in ("Z_B", "Z_D", "Z_β"))
        form = math.sqrt(radii) / norm
        return {"by form": form, "by load distribution": ratio / form}

    def _of_root(self, b: int, at: Sequence[np.intp]) -> dict[str, float]:
        """Factors of a root stress ratio, each over its counterpart in the standard: stress per
        load of a tooth pair (Y_F/f_ε Y_S Y_β Y_DT), load of the pair (K_γ K_Fα f_ε), distribution
        along the face (K_Fβ), bending of the rim (Y_B), load on the other flank (Y_M). The first
        three are those of the pass with a fixed gear body."""
        loaded, of = self.history[b], self.stresses[b]
        cycles = of.azimuth.shape[1]
        planet, cycle = divmod(int(at[0]), cycles)
        if loaded.part == "planet":
            planet, cycle = int(at[1]), int(at[0])
        elif self._is_stationary:
            planet, tooth = int(at[0]), 2.0 * math.pi * at[1] / self.pair.gears["ring"].teeth
            cycle = int(np.argmax(np.cos(of.azimuth[planet] - tooth)))
        member = 0 if loaded.part == "planet" else 1
        place = planet, cycle
        train = self.trains[self.loads[b].groups[loaded.group].deviated]
        fixed_body = roots_in_bin(train, self.trains[0].bins[b], loaded.group, place, member)
        lines = {**loaded.factors, **loaded.state.factors}
        norm = {symbol: line.value for symbol, line in lines.items()}
        factor, rim = norm["K_A"] * norm["K_v"], norm.get("Y_B", 1.0)
        normal = norm["F_t"] / math.cos(self.pair.base_helix_angle)
        normal /= math.cos(self.pair.transverse_angle)
        share = contact_line_factor(
            self.pair.geometry, self.pair.base_helix_angle, self.pair.rules.edition
        )
        largest, counted = (float(x[at]) / factor for x in (self._maps(b)[0], self.stress(b)))
        form = fixed_body.even / fixed_body.pair_load * share * rim * normal / (1e6 * norm["σ_F0"])
        sharing = fixed_body.pair_load / (share * normal * norm["K_γ"] * norm["K_Fα"])
        return {
            "by form": form,
            "by sharing between pairs": sharing,
            "by distribution along the face": fixed_body.held / fixed_body.even / norm["K_Fβ"],
            "by rim": largest / fixed_body.held / rim,
            "by alternation": counted / largest * _computed_factor(self.pair, loaded),
        }
