"""A case of proposed stages that ``check`` accepts without a warning."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

from flexgear.coupling.build import require_workable
from flexgear.files.case_text import Rated, new_case_text
from flexgear.gears.implausible import implausible
from flexgear.gears.power_flow import power_flow
from flexgear.gears.sizing import Proposal, StageRequest, proposals
from flexgear.model.errors import InputError
from flexgear.model.load import case_of_toml

MAX_TRIALS = 12  # tooth numbers of a stage that are tried, the best first


def proposed_case(requests: Sequence[StageRequest], rated: Rated) -> tuple[str, list[Proposal]]:
    """Text of a case of stages in series, the slowest first, and the proposed stages.

    requests: without torque and speed, which follow from ``rated`` and the ratios. InputError where
    no tooth numbers fit a request, or ``check`` refuses every case or warns of it.
    """
    torque, speed = rated.torque, rated.speed
    stages: list[Proposal] = []
    for request in reversed(requests) if rated.at_sun else requests:
        if rated.at_sun:
            stage = _accepted(
                replace(
                    request,
                    torque=torque * request.ratio,
                    speed=speed / request.ratio,
                )
            )
            torque, speed = torque * stage.ratio, speed / stage.ratio
            stages.insert(0, stage)
        else:
            stage = _accepted(replace(request, torque=torque, speed=speed))
            torque, speed = torque / stage.ratio, speed * stage.ratio
            stages.append(stage)
    text = new_case_text(stages, rated)
    fault = _fault(text)
    if fault is not None:
        raise fault
    return text + _duration(text), stages


def _duration(text: str) -> str:
    """Section with the usual duration where a turn of the slowest stage takes too many steps, else
    nothing."""
    from flexgear.solve.transient import cut_short, usual_duration  # imports all solvers

    case = case_of_toml(tomllib.loads(text), "new", "new")
    flow = power_flow(case)
    if not cut_short(case, flow):
        return ""
    span = f"{usual_duration(case, flow):.3g}"
    return (
        f"\n[solver]\nduration_s = {span:<12}# a whole turn of the slowest stage takes many steps\n"
    )


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


def _fault(text: str) -> InputError | None:
    """Reason why the case cannot be computed, or its first implausible figure; None without one."""
    try:
        case = case_of_toml(tomllib.loads(text), "new", "new")
        require_workable(case)
    except InputError as fault:
        return fault
    doubts = implausible(case, power_flow(case))
    return InputError("new", "check", doubts[0], "change what is asked for") if doubts else None
