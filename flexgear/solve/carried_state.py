"""A transient that starts where another of the same train has ended.

Bodies, springs and gear meshes have to be the same; machines, loads and options of the solver may
be others, so that a sweep of speed goes step by step and back, and each step has the motion that
the last one left.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexgear.analysis.start import CarriedState, state_size, unpacked_state
from flexgear.analysis.transient import Drive, prescribed_values
from flexgear.coupling.machines import GivenSpeed
from flexgear.coupling.modal import ModalSystem
from flexgear.model.content import content_hash
from flexgear.model.errors import InputError
from flexgear.model.units import RPM
from flexgear.solve.model import Model

_OF_TRAIN = (
    "kinematics", "gyroscopic", "gravity", "material", "stages", "joints", "held", "housing",
    "lubricant",
)  # fmt: skip
SAME_SPEED = 1e-6  # of a port's rated speed, by which a held speed may miss that of the other run


def state_content(model: Model) -> str:
    """SHA-256 of what two transients have in common if one starts from the end of the other."""
    case = model.case
    ports = [[port.member, case.port_inertia(port.member)] for port in case.ports]
    return content_hash([case.content_hash(*_OF_TRAIN), model.variant, ports])


def end_of(earlier: xr.Dataset, source: str) -> float:
    """Time at which a transient has ended, s; InputError where it does not say."""
    if "end_state" not in earlier or "end_time_s" not in earlier.attrs:
        remedy = "give what transient() returned, or the file of a transient of this version"
        raise InputError(source, "start", "holds no end of a transient", remedy)
    return float(earlier.attrs["end_time_s"])


def carried_state(
    model: Model, modal: ModalSystem, drive: Drive, earlier: xr.Dataset
) -> CarriedState:
    """The end of an ``earlier`` transient as the start of one under ``drive``.

    InputError where it is none of this train, or a held speed would jump.
    """
    source = model.case.source
    time = end_of(earlier, source)
    values = earlier["end_state"].to_numpy()
    same = earlier.attrs.get("state_content") == state_content(model)
    if not same or len(values) != state_size(modal):
        raise InputError(
            source, "start", f"is the end of a run of another train, {earlier.attrs.get('case')}",
            "machines, loads and solver may differ, bodies, springs and gear meshes not",
        )  # fmt: skip
    state = unpacked_state(modal, values)
    prescribed = prescribed_values(modal, drive, np.full(1, time))[0]
    speeds = modal.system.port_rows @ modal.modes @ state.velocity
    for p, machine in enumerate(modal.system.machines):
        rated = abs(model.flow.speed[modal.system.ports[p].name])
        if isinstance(machine, GivenSpeed) and abs(prescribed[p] - speeds[p]) > SAME_SPEED * rated:
            raise InputError(
                source, f"machine of {modal.system.ports[p].name}",
                f"holds {RPM * prescribed[p]:.6g} rpm at {time:g} s, where the earlier run ended "
                f"at {RPM * speeds[p]:.6g} rpm",
                "let its history begin there, and ramp softly",
            )  # fmt: skip
    return CarriedState(state, time)
