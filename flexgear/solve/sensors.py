"""Sensors of a case on its coupled system: rows that recover their places, and their signals."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.recording import SAMPLES, Clock, Quantity, Recorder
from flexgear.analysis.recovery import Recovery
from flexgear.analysis.transient import Transient
from flexgear.arrays import Array
from flexgear.coupling.pace import Pace
from flexgear.coupling.system import System
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.read import nearest
from flexgear.model.section import Refusal
from flexgear.model.sensor import USUAL_RATE, Sensor, check_rate
from flexgear.solve.bodies import Bodies
from flexgear.solve.sensor_columns import Columns
from flexgear.solve.sensor_places import SensorPlace, torque_names
from flexgear.solve.sensor_quantities import ScalarQuantity

UNITS = {
    "acceleration": "m/s2", "velocity": "m/s", "displacement": "m", "strain": "1",
    "speed": "rad/s", "torque": "N m",
}  # fmt: skip
STATIC = ("displacement", "strain", "torque")  # what an equilibrium has


@dataclass(frozen=True)
class Sensors:
    """Those of a case: what they measure, by the columns of what is recovered."""

    sensors: tuple[Sensor, ...]
    clock: Clock
    columns: Columns
    quantities: tuple[Quantity, ...]
    inputs: tuple[int, ...]  # columns of the independent rotations

    @property
    def labels(self) -> dict[str, Any]:
        """Of the axis of sensors."""
        return {
            "sensor": [s.name for s in self.sensors],
            "sensor_quantity": [s.measures for s in self.sensors],
            "sensor_unit": [UNITS[s.measures] for s in self.sensors],
        }

    @property
    def static_labels(self) -> dict[str, Any]:
        """Of the axis of those that an equilibrium has values of."""
        static = [s for s in self.sensors if s.measures in STATIC]
        return {
            "static_sensor": [s.name for s in static],
            "static_sensor_unit": [UNITS[s.measures] for s in static],
        }

    def static(self, recovery: Recovery) -> Array:
        """Values (p, s) of sensors in equilibria."""
        assert isinstance(recovery.result, Equilibrium)
        values = self.columns.values(recovery)
        positions = [
            (quantity, quantity.position(values))
            for sensor, quantity in zip(self.sensors, self.quantities, strict=True)
            if sensor.measures in STATIC
        ]
        out = [quantity.part(position, position) for quantity, position in positions]
        return np.stack(out, axis=1) if out else np.zeros((len(values), 0))

    def recorder(self, step: float) -> Recorder:
        """What takes samples of a run, which are ``step`` s apart where they are closest, and gives
        signals and independent rotations."""
        rotations = [ScalarQuantity((column,)) for column in self.inputs]
        return Recorder(replace(self.clock, step=step), [*self.quantities, *rotations])

    def record(self, recorder: Recorder, recovery: Recovery) -> tuple[Array, Array, Array]:
        """Times (m,), signals (m, s) and independent rotations (m, F) of some samples more."""
        assert isinstance(recovery.result, Transient)
        time, both = recorder.append(recovery.result.time, self.columns.values(recovery))
        count = len(self.quantities)
        return time, both[:, :count], both[:, count:]


def sensors_of(case: Case, system: System, bodies: Bodies, pace: Pace) -> Sensors | None:
    """Of a case; None without any. InputError for a place beside the body, a body without FE mesh,
    and a band beyond that of the modes."""
    if not case.sensors:
        return None
    columns = Columns(system)
    quantities = tuple(_quantities(case, system, bodies, columns))
    inputs = tuple(columns.rolling(row) for row in system.input_rows)
    return Sensors(case.sensors, clock_of(case, pace), columns, quantities, inputs)


def clock_of(case: Case, pace: Pace) -> Clock:
    """InputError for a band beyond that of the modes."""
    top = min(pace.band, pace.modes_to or pace.band)
    band = top if case.recorder.band is None else case.recorder.band
    if band > top * (1 + 1e-9):
        raise InputError(
            case.source,
            "recorder.band_hz",
            f"{band:.6g} Hz is beyond {top:.6g} Hz, up to which the modes answer",
            "lower it, or raise solver.modes_band_hz or solver.gear_mesh_orders (and modes_to_hz)",
        )
    rate = case.recorder.sampling_rate
    try:
        check_rate(band, rate := USUAL_RATE * band if rate is None else rate)
    except Refusal as fault:
        key, problem, remedy = "recorder.sampling_rate_hz", fault.problem, fault.remedy
        raise InputError(case.source, key, problem, remedy) from None
    return Clock(band, rate, 1.0 / (SAMPLES * band))


def _quantities(case: Case, system: System, bodies: Bodies, columns: Columns) -> Iterator[Quantity]:
    for k, sensor in enumerate(case.sensors):
        if sensor.measures == "torque":
            names = torque_names(system)
            if sensor.on not in names:
                problem = f"{sensor.on} is no port, joint or bearing that passes a torque"
                remedy = nearest(sensor.on, names)
                raise InputError(case.source, f"sensors[{k}].on", problem, remedy)
            yield ScalarQuantity((columns.torque(sensor.on),))
        else:
            yield SensorPlace(case, system, bodies, sensor, k).quantity(columns)
