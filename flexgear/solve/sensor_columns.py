"""Values that sensors need of every sample of a result."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from flexgear.analysis.recovery import Recovery
from flexgear.arrays import Array
from flexgear.coupling.system import System


@dataclass
class Columns:
    """What gives them: rows of elastic motion, multiples of the independent rotations, torques of
    ports and of springs."""

    system: System
    count: int = 0
    rows: list[Array] = field(default_factory=list)
    row_columns: list[int] = field(default_factory=list)
    angles: list[Array] = field(default_factory=list)
    angle_columns: list[int] = field(default_factory=list)
    torques: dict[int, str] = field(default_factory=dict)

    def motion(self, rows: Array) -> int:
        """First of the columns of rows (k, d)."""
        first, self.count = self.count, self.count + len(rows)
        self.rows += list(rows)
        self.row_columns += range(first, self.count)
        return first

    def rolling(self, row: Array) -> int:
        """Column of what a row (d,) is when the train rolls without deflection."""
        self.angles.append(row @ self.system.rolling)
        self.angle_columns.append(self.count)
        self.count += 1
        return self.count - 1

    def torque(self, name: str) -> int:
        """Column of a port's or a spring's torque about z."""
        self.torques[self.count] = name
        self.count += 1
        return self.count - 1

    def values(self, recovery: Recovery) -> Array:
        """(t, columns) of all samples."""
        result = recovery.result
        out = np.empty((len(result.theta), self.count))
        if self.rows:
            out[:, self.row_columns] = recovery.named("sensors", lambda: np.vstack(self.rows))
        if self.angles:
            out[:, self.angle_columns] = recovery.rotations @ np.array(self.angles).T
        ports = [port.name for port in self.system.ports]
        for column, name in self.torques.items():
            if name in ports:
                out[:, column] = result.torques[:, ports.index(name)]
            else:
                out[:, column] = recovery.link_force(name)[:, 5]
        return out
