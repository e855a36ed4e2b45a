"""A proposal of flank modifications: helix slope, crowning and tip relief of the planets' flanks.

Gaps of slices are linear in amounts of the lead, and nearly of second order in those of relief,
which turns the flank (``gears.profile_contact``). So each amount is a table of gaps or two, made
once: with

    g = g_0 + Σ_i p_i g_i + p_i² q_i

every trial is a series of equilibria over a gear-mesh cycle and nothing else. The search is
Nelder and Mead's (SciPy): the largest line load is the largest of many, and has kinks. What is
proposed is put together anew, so that its figures are those of the case with its keys.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.optimize import minimize

from flexgear.analysis.equilibrium import Equilibrium, revolution
from flexgear.arrays import Array
from flexgear.coupling.pair_data import PairData, gap_columns, slice_gaps
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.faults import require_sound
from flexgear.model.modifications import Relief
from flexgear.results.face_load import face_figures
from flexgear.solve.angles import lead_speed, one_turn, stage_motions
from flexgear.solve.bodies import Progress, silent
from flexgear.solve.dataset import equilibrium_data
from flexgear.solve.face_load import worst_figures
from flexgear.solve.model import Model, assemble, rated_rotations

Aim = Literal["line-load", "transmission-error"]
LEAD = ("helix_slope", "lead_crowning", "end_relief")  # turn no flank across its profile
UNIT = 1e-6  # m: amounts are whole micrometres
POSITIONS = 12  # of a gear-mesh cycle
TRIALS = 60  # series of equilibria for each amount


@dataclass(frozen=True)
class Amount:
    """One amount that is sought.

    gear, flank, name: where it stands; base: what the case has there, m; start: what is added
    where the search begins, m; signed: may leave material standing.
    """

    gear: str
    flank: str
    name: str
    base: float
    start: float
    signed: bool

    @property
    def section(self) -> str:
        """Where it stands below its stage: a key, or of relief the section of its amount."""
        return f"{self.gear}.modifications.{self.flank}.{self.name}"

    @property
    def key(self) -> str:
        """Of the case, below its stage."""
        return self.section + (".amount" if self.name == "tip_relief" else "")


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
    tables = [_factors(model, stage, a) for a in amounts]
    start = np.array([a.start for a in amounts]) / UNIT
    least = np.array([-np.inf if a.signed else -a.base / UNIT for a in amounts])
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
    ground = _assembled(model, stage, amounts, best)
    return Proposal(
        amounts={a.key: a.base + float(x) * UNIT for a, x in zip(amounts, best, strict=True)},
        reliefs={a.section: _relief(case, stage, a) for a in amounts if a.name == "tip_relief"},
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
        """What the search makes small: largest line load, N/m, or largest transmission error, m, of
        all torques and planets, those of the ring's and of the sun's gear meshes added."""
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
    """What is sought, from where misalignment and a little crowning would put it."""
    stage_section = case.stage(stage)
    gear = "gear" if stage_section.kind == "parallel" else "planet"
    ground = getattr(stage_section, gear).modifications
    amounts = []
    for name, figures in face_figures(flat).items():
        labels = flat.sel(flank=name)
        if str(labels["flank_stage"].item()) != stage or int(labels["flank_planet"]) != 1:
            continue
        flank = "drive" if gear == "gear" else str(labels["flank_kind"].item())
        has = ground.of(flank)
        tilt, give = figures["misalignment_um"] * UNIT, figures["transmission_error_um"] * UNIT
        starts = {"helix_slope": tilt, "lead_crowning": 0.1 * abs(tilt) + UNIT}
        for what, start in starts.items():
            base = getattr(has, what) or 0.0
            amounts.append(Amount(gear, flank, what, base, start, signed=what == "helix_slope"))
        if relief:
            base = has.tip_relief.amount if has.tip_relief is not None else 0.0
            start = max(0.3 * abs(give), UNIT)
            amounts.append(Amount(gear, flank, "tip_relief", base, start, signed=False))
    return amounts


def _relief(case: Case, stage: str, amount: Amount) -> Relief:
    """Tip relief of a flank: the case's, or over a module of the path where it has none."""
    stage_section = case.stage(stage)
    has: Relief | None = (
        getattr(stage_section, amount.gear).modifications.of(amount.flank).tip_relief
    )
    return has or Relief(amount=UNIT, length=stage_section.normal_module, form="parabolic")


def _value(case: Case, stage: str, amount: Amount, added: float) -> object:
    """What the section of an amount says with so much more, m."""
    if amount.name != "tip_relief":
        return amount.base + added
    return _relief(case, stage, amount).model_copy(update={"amount": amount.base + added})


def _assembled(model: Model, stage: str, amounts: Sequence[Amount], added: Array) -> PairData:
    """Pairs of the model with flanks ground by so much more, µm."""
    keys = {
        f"stages.{stage}.{a.section}": _value(model.case, stage, a, float(x) * UNIT)
        for a, x in zip(amounts, added, strict=True)
    }
    return _ground(model, **keys)


def _factors(model: Model, stage: str, amount: Amount) -> Array:
    """``gap_factors`` of what is added to an amount."""
    key = f"stages.{stage}.{amount.section}"

    def value_at(total: float) -> object:
        return _value(model.case, stage, amount, total - amount.base)

    return gap_factors(model, key, value_at, amount.base, max(2.0 * abs(amount.start), UNIT))


def gap_factors(
    model: Model, key: str, value: Callable[[float], object], base: float, most: float
) -> Array:
    """Factors (2, K, T, n) of an amount and of its square, m/m and 1/m, in what it adds to the gaps
    of slices; value: of a key of the case, by the whole amount, m; most: that is mostly added."""
    before = slice_gaps(model.system.pairs)

    def by(added: float) -> Array:
        return (slice_gaps(_ground(model, **{key: value(base + added)})) - before) / added

    far = by(most)
    if key.rpartition(".")[2] in LEAD:
        return np.stack([far, np.zeros_like(far)])
    near = by(0.5 * most)
    square = (far - near) / (0.5 * most)
    return np.stack([near - 0.5 * most * square, square])


def _ground(model: Model, **keys: object) -> PairData:
    """Pairs of the model with other values of keys of the case."""
    case = model.case.with_(**keys)
    return assemble(case, bodies=model.bodies, variant=model.system.rigid_bodies).system.pairs


def _gaps(pairs: PairData, tables: Sequence[Array], amounts: Array) -> PairData:
    """The pairs with gaps of amounts, µm; only columns of gaps change."""
    table = pairs.slice_table.copy()
    for number, count in set(zip(pairs.table.tolist(), pairs.slices.tolist(), strict=True)):
        for factors, p in zip(tables, UNIT * amounts, strict=True):
            for power, factor in enumerate(factors, 1):
                table[number, :, gap_columns(count)] += p**power * factor[number, :, :count]
    return pairs._replace(slice_table=table)
