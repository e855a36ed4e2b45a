"""A case of proposed stages that ``check`` accepts without a warning."""

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import islice

from flexgear.coupling.build import require_workable
from flexgear.coupling.pace import SAMPLES, STEPS, case_pace
from flexgear.files.case_text import Rated, new_case_text
from flexgear.gears.implausible import implausible
from flexgear.gears.power_flow import power_flow
from flexgear.gears.sizing import Proposal, StageRequest, proposals
from flexgear.model.errors import InputError
from flexgear.model.load import case_of_toml

CYCLES = 8  # of the gear mesh that a transient of slow gears covers if possible
COARSEST = 10  # steps in a period of f_E
MAX_TRIALS = 12  # tooth numbers of a stage that are tried, the best first


def proposed_case(requests: Sequence[StageRequest], rated: Rated) -> tuple[str, list[Proposal]]:
    """Text of a case of stages in series, the slowest first, and the proposed stages.

    requests: without torque and speed, which follow from ``rated`` and the ratios. InputError where
    no tooth numbers fit a request, or ``check`` refuses every case or warns of it.
    """
    torque, speed = rated.torque, rated.speed
    numbers = [*range(len(requests))]
    stages: dict[int, Proposal] = {}
    for number in reversed(numbers) if rated.at_sun else numbers:
        request = requests[number]
        ratio = request.ratio if rated.at_sun else 1.0
        request = replace(request, torque=torque * ratio, speed=speed / ratio)
        try:
            stage = stages[number] = _accepted(request)
        except InputError as refusal:
            if not stages and not rated.at_sun:
                raise
            raise _of_stage(refusal, number, rated) from None
        ratio = stage.ratio if rated.at_sun else 1.0 / stage.ratio
        torque, speed = torque * ratio, speed / ratio
    proposed = [stages[number] for number in numbers]
    text = new_case_text(proposed, rated)
    fault = _fault(text)
    if fault is not None:
        raise fault
    return text + _solver(text, rated), proposed


def _of_stage(fault: InputError, number: int, rated: Rated) -> InputError:
    """A fault of a torque or speed that follows from that of the other end, by the option that was
    given; other faults as they are. number: of the stage from 0, the slowest first."""
    if fault.key not in ("--torque-nm", "--speed-rpm"):
        return fault
    key = fault.key.replace("--", "--sun-") if rated.at_sun else fault.key
    problem = f"does not suit stage {number + 1}: {fault.problem}"
    return InputError("new", key, problem, "change it, or the ratios")


def _solver(text: str, rated: Rated) -> str:
    """Section with the usual duration where a turn of the slowest stage takes too many steps, else
    nothing. Where even a gear-mesh period would, steps are longer. InputError where the longest
    ones, ``COARSEST`` to a period of f_E, do not reach one."""
    from flexgear.solve.transient import MAX_STEPS, cut_short, usual_duration  # imports all solvers

    case = case_of_toml(tomllib.loads(text), "new", "new")
    flow, pace = power_flow(case), case_pace(case)
    if not cut_short(case, flow):
        return ""
    span, steps = usual_duration(case, flow), ""
    if span * pace.gear_mesh < 1:
        step = min(CYCLES / (pace.gear_mesh * MAX_STEPS), 1 / (COARSEST * pace.resonance))
        span = MAX_STEPS * step
        steps = (
            f"time_step_s = {step:<27.3g}# ten or more in a period of the gears' vibration\n"
            f"output_interval_s = {STEPS / SAMPLES * step:<21.3g}# of every fifth step\n"
        )
    if span * pace.gear_mesh < 1:
        raise InputError(
            "new", "--sun-speed-rpm" if rated.at_sun else "--speed-rpm",
            f"is so low that a gear-mesh period, {1 / pace.gear_mesh:.3g} s, is longer than "
            f"{MAX_STEPS // COARSEST} periods in which these gears vibrate",
            f"take at least {1.01 / (span * pace.gear_mesh):.3g} times the speed",
        )  # fmt: skip
    why = "# a whole turn of the slowest stage takes many steps"
    return f"\n[solver]\nduration_s = {span:<28.3g}{why}\n{steps}"


def _accepted(request: StageRequest) -> Proposal:
    """The first proposal that ``check`` accepts without a warning."""
    fault: InputError | None = None
    for proposal in islice(proposals(request), MAX_TRIALS):
        fault = _fault(new_case_text([proposal], Rated(request.torque, request.speed)))
        if fault is None:
            return proposal
    assert fault is not None  # ``proposals`` yields one or raises InputError
    raise InputError(
        "new", "--torque-nm",
        f"of {request.torque:.4g} N m with {request.planets} planets leads to {fault.key}: "
        f"{fault.problem}",
        "use more planets or a lower ratio for a smaller stage",
    ) from None  # fmt: skip


@lru_cache(maxsize=1)  # a case of one stage is the text by which that stage was accepted
def _fault(text: str) -> InputError | None:
    """Reason why the case cannot be computed, or its first implausible figure; None without one."""
    try:
        case = case_of_toml(tomllib.loads(text), "new", "new")
        require_workable(case)
    except InputError as fault:
        return fault
    doubts = implausible(case, power_flow(case))
    return InputError("new", "check", doubts[0], "change what is asked for") if doubts else None
