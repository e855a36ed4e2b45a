"""A proposal of flank modifications: helix slope, crowning and tip relief of the planets' flanks.

With gaps of slices as sums over amounts (``ground_flanks``) every trial is a series of equilibria
over a gear-mesh cycle and nothing else. The search is Nelder and Mead's (SciPy): the largest line
load is the largest of many, and has kinks. What is proposed is put together anew, so that its
figures are those of the case with its keys.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.optimize import minimize

from flexgear.analysis.equilibrium import Equilibrium, revolution
from flexgear.arrays import Array
from flexgear.coupling.pair_data import PairData, gap_columns
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.faults import require_sound
from flexgear.model.modifications import Relief
from flexgear.results.face_load import face_figures
from flexgear.solve.angles import lead_speed, one_turn, stage_motions
from flexgear.solve.bodies import Progress, silent
from flexgear.solve.dataset import equilibrium_data
from flexgear.solve.face_load import worst_figures
from flexgear.solve.model import Model, rated_rotations
from flexgear.studies.ground_flanks import UNIT, Ground, gap_factors, ground_pairs

Aim = Literal["line-load", "transmission-error"]
POSITIONS = 12  # of a gear-mesh cycle
TRIALS = 60  # series of equilibria for each amount


@dataclass(frozen=True)
class Amount:
    """One amount that is sought. start: what is added where the search begins, m; signed: may leave
    material standing."""

    ground: Ground
    start: float
    signed: bool = False

    @property
    def key(self) -> str:
        """Key of the case, below its stage."""
        return self.ground.key + (".amount" if self.ground.relief else "")


@dataclass(frozen=True)
class Proposal:
    """amounts: m by key of the case below its stage; reliefs: tip relief by its section, whose
    amount is among them; before, after: figures of every flank that
    carries, by torque share, as ``solve.face_load`` gives them; data: equilibria before and after
    at the first share; trials: series of equilibria that were solved."""

    amounts: dict[str, float]
    reliefs: dict[str, Relief]
    before: dict[float, dict[str, dict[str, float]]]
    after: dict[float, dict[str, dict[str, float]]]
    data: tuple[xr.Dataset, xr.Dataset]
    trials: int


def require_slices(case: Case, stage: str) -> None:
    """InputError where the pairs of a stage have no slices."""
    if case.stage(stage).gear_mesh.model != "face_load":
        raise InputError(
            case.name, f"{stage}.gear_mesh.model",
            f"is {case.stage(stage).gear_mesh.model!r}, which knows no load along the face",
            'set it to "face_load"',
        )  # fmt: skip


def propose_modifications(
    model: Model,
    stage: str,
    *,
    shares: Sequence[float] = (1.0,),
    aim: Aim = "line-load",
    relief: bool = False,
    trials: int = TRIALS,
    progress: Progress = silent,
) -> Proposal:
    """Amounts of the planets' flanks towards sun and ring (of the gear's in a parallel stage) that
    make the largest line load, or the largest peak-to-peak transmission error, at all ``shares`` of
    the rated torque least, added up over sun and ring. relief: tip relief of the planets, too, over
    a module of the path where the case has none. trials: series of equilibria for each amount.

    InputError where pairs have no slices.
    """
    case = model.case
    require_slices(case, stage)
    require_sound(case, "a proposal of modifications")
    angles = _cycle(model, stage)
    number = [s.name for s in case.stages].index(stage)
    of_stage = np.array([label.stage == number for label in model.system.gear_meshes])
    trial = _Trial(model, angles, tuple(shares), of_stage)
    flat = trial.data(model.system.pairs, shares[0])
    amounts = _amounts(case, stage, flat, relief)
    tables = [gap_factors(model, a.ground, max(2.0 * abs(a.start), UNIT)) for a in amounts]
    start = np.array([a.start for a in amounts]) / UNIT
    least = np.array([-np.inf if a.signed else -a.ground.base / UNIT for a in amounts])
    scale = max(float(np.abs(start).max()), 5.0)

    def cost(p: Array) -> float:
        held = np.maximum(p, least)
        value = trial.worst(_gaps(model.system.pairs, tables, held), aim)
        progress("flanks", min(trial.count / (trials * len(p)), 0.99))
        return value * (1.0 + float(np.abs(held - p).sum()) / scale)

    corners = np.vstack([start, *(start + 0.5 * scale * row for row in np.eye(len(start)))])
    optimum = minimize(
        cost, start, method="Nelder-Mead",
        options={
            "initial_simplex": corners, "maxfev": trials * len(start), "xatol": 0.5, "fatol": 0.0,
        },
    )  # fmt: skip
    best = np.round(np.maximum(optimum.x, least))
    if cost(best) > cost(np.zeros_like(best)):
        best = np.zeros_like(best)
    progress("flanks", 1.0)
    added = [(a.ground, float(x) * UNIT) for a, x in zip(amounts, best, strict=True)]
    ground = ground_pairs(model, added)
    return Proposal(
        amounts={a.key: g.base + more for a, (g, more) in zip(amounts, added, strict=True)},
        reliefs={g.key: g.relief for g, _ in added if g.relief is not None},
        before={s: face_figures(trial.data(model.system.pairs, s)) for s in shares},
        after={s: face_figures(trial.data(ground, s)) for s in shares},
        data=(flat, trial.data(ground, shares[0])),
        trials=trial.count,
    )


@dataclass
class _Trial:
    """Equilibria of a model with other gaps.

    of_stage: (M,) whether a gear mesh is one of the stage; count: series that were solved.
    """

    model: Model
    angles: Array
    shares: tuple[float, ...]
    of_stage: NDArray[np.bool_]
    count: int = 0

    def data(self, pairs: PairData, share: float) -> xr.Dataset:
        """Equilibria over the cycle at a share of the rated torque."""
        equilibrium = self._solved(pairs, share)
        system = equilibrium.modal.system
        return equilibrium_data(
            replace(self.model, system=system, shared_modal=equilibrium.modal), equilibrium
        )

    def worst(self, pairs: PairData, aim: Aim) -> float:
        """Quantity that the search minimises: largest line load, N/m, or largest transmission
        error, m, of all torques and planets, the sum of those of the ring's and of the sun's gear
        meshes."""
        at = ("line-load", "transmission-error").index(aim)
        figures = [worst_figures(self._solved(pairs, share))[at] for share in self.shares]
        largest, kinds = np.max(figures, axis=0)[self.of_stage], pairs.kind[self.of_stage]
        return float(sum(largest[kinds == kind].max() for kind in np.unique(kinds)))

    def _solved(self, pairs: PairData, share: float) -> Equilibrium:
        self.count += 1
        system = self.model.system.with_(pairs=pairs)
        modal = replace(self.model.modal, system=system)
        return revolution(modal, self.angles, share * system.rated_torque)


def _cycle(model: Model, stage: str) -> Array:
    """Rotations (p, F) rad over one gear-mesh cycle of a stage."""
    motions = stage_motions(model.case, model.flow)
    motion = next(m for m in motions if m.name == stage)
    if not motion.theta:
        lead = np.zeros(1)
    else:
        lead = one_turn(motion, lead_speed(model.case, model.flow), POSITIONS, 1)
    return np.asarray(rated_rotations(model.system, lead))


def _amounts(case: Case, stage: str, flat: xr.Dataset, relief: bool) -> list[Amount]:
    """Amounts to optimise, with starting values from misalignment and a little crowning."""
    stage_section = case.stage(stage)
    gear = "gear" if stage_section.kind == "parallel" else "planet"
    ground = getattr(stage_section, gear).modifications
    amounts = []
    for name, figures in face_figures(flat).items():
        labels = flat.sel(flank=name)
        if str(labels["flank_stage"].item()) != stage or int(labels["flank_planet"]) != 1:
            continue
        flank = "drive" if gear == "gear" else str(labels["flank_kind"].item())
        has, at = ground.of(flank), f"{gear}.modifications.{flank}"
        tilt, give = figures["misalignment_um"] * UNIT, figures["transmission_error_um"] * UNIT
        slope = Ground(stage, f"{at}.helix_slope", has.helix_slope or 0.0)
        crowning = Ground(stage, f"{at}.lead_crowning", has.lead_crowning or 0.0)
        amounts += [Amount(slope, tilt, signed=True), Amount(crowning, 0.1 * abs(tilt) + UNIT)]
        if relief:
            module = stage_section.normal_module
            tip = has.tip_relief or Relief(amount=UNIT, length=module, form="parabolic")
            base = tip.amount if has.tip_relief else 0.0
            of_tip = Ground(stage, f"{at}.tip_relief", base, tip)
            amounts.append(Amount(of_tip, max(0.3 * abs(give), UNIT)))
    return amounts


def _gaps(pairs: PairData, tables: Sequence[Array], amounts: Array) -> PairData:
    """The pairs with gaps of amounts, µm; only columns of gaps change."""
    table = pairs.slice_table.copy()
    for number, count in set(zip(pairs.table.tolist(), pairs.slices.tolist(), strict=True)):
        for factors, p in zip(tables, UNIT * amounts, strict=True):
            for power, factor in enumerate(factors, 1):
                table[number, :, gap_columns(count)] += p**power * factor[number, :, :count]
    return pairs._replace(slice_table=table)
