"""A proposal of flank modifications: helix slope, crowning and tip relief of the planets' flanks.

Gaps of slices are polynomials of the amounts (``flank_amounts``), so a trial needs only a series of
equilibria over a gear-mesh cycle. The search is that of Nelder and Mead (SciPy), as the largest
line load is a maximum of many values and therefore not smooth. The proposed amounts are assembled
once more from the keys of the case, so that the figures are exactly those of the proposed case.
"""

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
from flexgear.studies.flank_amounts import UNIT, FlankAmount, gap_coefficients, modified_pairs

Aim = Literal["line-load", "transmission-error"]
POSITIONS = 12  # of a gear-mesh cycle
TRIALS = 60  # series of equilibria for each amount
LEAST_GAIN = 0.01  # of the objective, below which flanks stay as they are


@dataclass(frozen=True)
class SoughtAmount:
    """An amount to optimise. start: increase at which the search begins, m; signed: whether the
    amount may be negative."""

    flank: FlankAmount
    start: float
    signed: bool = False

    @property
    def key(self) -> str:
        """Key of the case, below its stage."""
        return self.flank.key + (".amount" if self.flank.relief else "")


@dataclass(frozen=True)
class Proposal:
    """Proposed flank modifications of a stage and their effect.

    amounts: m, by key below the stage; reliefs: tip reliefs by key of their section, whose amounts
    are in ``amounts``; before, after: figures of every loaded flank by torque share, as of
    ``results.face_load``; data: equilibria before and after at the first share; trials: number of
    series of equilibria that were solved.
    """

    amounts: dict[str, float]
    reliefs: dict[str, Relief]
    before: dict[float, dict[str, dict[str, float]]]
    after: dict[float, dict[str, dict[str, float]]]
    data: tuple[xr.Dataset, xr.Dataset]
    trials: int


def require_slices(case: Case, stage: str) -> None:
    """InputError where the pairs of a stage have no slices."""
    if case.stage(stage).gear_mesh.model != "face_load":
        problem = f"is {case.stage(stage).gear_mesh.model!r}, which knows no load along the face"
        raise InputError(case.source, f"{stage}.gear_mesh.model", problem, 'set it to "face_load"')


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
    """Flank modifications of the planets towards sun and ring (in a parallel stage of the gear)
    that minimise the largest line load, or the largest peak-to-peak transmission error, at all
    ``shares`` of the rated torque, summed over sun and ring gear meshes.

    relief: whether tip relief of the planets is proposed, too; over a length of one module where
    the case has none. trials: series of equilibria for each amount. InputError where pairs have no
    slices.
    """
    case = model.case
    require_slices(case, stage)
    require_sound(case, "a proposal of modifications")
    angles = _cycle(model, stage)
    number = [s.name for s in case.stages].index(stage)
    of_stage = np.array([label.stage == number for label in model.system.gear_meshes])
    trial = _Trial(model, angles, tuple(shares), of_stage)
    unmodified = trial.data(model.system.pairs, shares[0])
    amounts = _sought_amounts(case, stage, unmodified, relief)
    coefficients = [gap_coefficients(model, a.flank, max(2 * abs(a.start), UNIT)) for a in amounts]
    start = np.array([a.start for a in amounts]) / UNIT
    lower = np.array([-np.inf if a.signed else -a.flank.base / UNIT for a in amounts])
    scale = max(float(np.abs(start).max()), 5.0)

    def cost(p: Array) -> float:
        bounded = np.maximum(p, lower)
        value = trial.worst(_with_gaps(model.system.pairs, coefficients, bounded), aim)
        progress("flanks", min(trial.count / (trials * len(p)), 0.99))
        return value * (1.0 + float(np.abs(bounded - p).sum()) / scale)

    corners = np.vstack([start, *(start + 0.5 * scale * row for row in np.eye(len(start)))])
    optimum = minimize(
        cost, start, method="Nelder-Mead",
        options={
            "initial_simplex": corners, "maxfev": trials * len(start), "xatol": 0.5, "fatol": 0.0,
        },
    )  # fmt: skip
    best = np.maximum(np.round(optimum.x), lower)
    if cost(best) > (1.0 - LEAST_GAIN) * cost(np.zeros_like(best)):
        best = np.zeros_like(best)
    progress("flanks", 1.0)
    increases = [(a.flank, float(x) * UNIT) for a, x in zip(amounts, best, strict=True)]
    modified = modified_pairs(model, increases)
    return Proposal(
        amounts={a.key: f.amount(more) for a, (f, more) in zip(amounts, increases, strict=True)},
        reliefs={flank.key: flank.relief for flank, _ in increases if flank.relief is not None},
        before={s: face_figures(trial.data(model.system.pairs, s)) for s in shares},
        after={s: face_figures(trial.data(modified, s)) for s in shares},
        data=(unmodified, trial.data(modified, shares[0])),
        trials=trial.count,
    )


@dataclass
class _Trial:
    """Equilibria of a model with changed gaps.

    of_stage: (M,) whether a gear mesh belongs to the stage; count: number of solved series.
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
        """Objective of the search: largest line load, N/m, or largest peak-to-peak transmission
        error, m, over all torques and planets, summed over ring and sun gear meshes."""
        column = ("line-load", "transmission-error").index(aim)
        figures = [worst_figures(self._solved(pairs, share))[column] for share in self.shares]
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
    rotations = np.zeros(1)
    if motion.theta:
        rotations = one_turn(motion, lead_speed(model.case, model.flow), POSITIONS, 1)
    return np.asarray(rated_rotations(model.system, rotations))


def _sought_amounts(
    case: Case, stage: str, unmodified: xr.Dataset, relief: bool
) -> list[SoughtAmount]:
    """Amounts to optimise, with starting values from misalignment and a little crowning."""
    stage_section = case.stage(stage)
    gear = "gear" if stage_section.kind == "parallel" else "planet"
    of_gear = getattr(stage_section, gear).modifications
    amounts = []
    for name, figures in face_figures(unmodified).items():
        labels = unmodified.sel(flank=name)
        if str(labels["flank_stage"].item()) != stage or int(labels["flank_planet"]) != 1:
            continue
        flank = "drive" if gear == "gear" else str(labels["flank_kind"].item())
        stated, section = of_gear.of(flank), f"{gear}.modifications.{flank}"
        tilt, error = figures["misalignment_um"] * UNIT, figures["transmission_error_um"] * UNIT
        slope = FlankAmount(stage, f"{section}.helix_slope", stated.helix_slope or 0.0)
        crowning = FlankAmount(stage, f"{section}.lead_crowning", stated.lead_crowning or 0.0)
        amounts.append(SoughtAmount(slope, tilt, signed=True))
        amounts.append(SoughtAmount(crowning, 0.1 * abs(tilt) + UNIT))
        if relief:
            module = stage_section.normal_module
            tip = stated.tip_relief or Relief(amount=UNIT, length=module, form="parabolic")
            base = tip.amount if stated.tip_relief else 0.0
            of_tip = FlankAmount(stage, f"{section}.tip_relief", base, tip)
            amounts.append(SoughtAmount(of_tip, max(0.3 * abs(error), UNIT)))
    return amounts


def _with_gaps(pairs: PairData, coefficients: Sequence[Array], increases: Array) -> PairData:
    """The pairs with gaps of increased amounts, µm; coefficients: ``gap_coefficients`` of each."""
    table = pairs.slice_table.copy()
    for number, count in set(zip(pairs.table.tolist(), pairs.slices.tolist(), strict=True)):
        for of_amount, p in zip(coefficients, UNIT * increases, strict=True):
            for power, factor in enumerate(of_amount, 1):
                table[number, :, gap_columns(count)] += p**power * factor[number, :, :count]
    return pairs._replace(slice_table=table)
