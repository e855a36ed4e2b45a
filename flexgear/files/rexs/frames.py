"""Places and axes of components in the gear unit's frame.

A component's support_vector and axes are given in the frame of the component that
reference_component_for_position names (the gear unit, as a rule); one without a place of its own
sits on its shaft at u_coordinate_on_shaft.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.files.rexs.document import Component, Document, number, vector

Array = NDArray[np.float64]
_ALONG = 1e-9
_ALIGNED = 1e-6  # 1 − cos of the angle between axes that count as parallel: 1.4 mrad


@dataclass(frozen=True)
class Frame:
    """origin (3,) mm and axes (3, 3), rows u, v, w, both in the gear unit's frame."""

    origin: Array
    axes: Array


class Frames:
    """Frames of a document's components."""

    def __init__(self, document: Document) -> None:
        self.document = document
        mains = [*document.kind("gear_unit"), *document.kind("shaft")]
        self._main = next((m for m in mains if vector(m, "u_axis_vector")), None)
        axes = None if self._main is None else _axes(self._main)
        self._axes = np.eye(3) if axes is None else axes
        self._known: dict[int, Frame | None] = {}

    def of(self, component: Component) -> Frame | None:
        """Its frame, None where the file does not place it."""
        if component.id not in self._known:
            self._known[component.id] = None  # for chains that bite their tail
            self._known[component.id] = self._frame_of(component)
        return self._known[component.id]

    def sense(self, component: Component) -> float:
        """+1 or −1: direction of the u axis of a component's shaft against the gear unit's."""
        shaft = component if component.kind == "shaft" else self.shaft(component)
        frame = self.of(shaft) if shaft is not None else None
        return -1.0 if frame is not None and frame.axes[0, 0] < 0 else 1.0

    def is_parallel(self, component: Component) -> bool:
        """Whether its axis is parallel to the gear unit's; true where the file gives no axis."""
        frame = self.of(component)
        return frame is None or abs(float(frame.axes[0, 0])) > 1.0 - _ALIGNED

    def shaft(self, part: Component) -> Component | None:
        """The shaft that a part sits on."""
        return next((w for w in self.document.wholes(part) if w.kind == "shaft"), None)

    def _frame_of(self, component: Component) -> Frame | None:
        place = vector(component, "support_vector")
        if place is None:
            return self._on_shaft(component)
        axes, base = _axes(component), self._base(component)
        axes = np.eye(3) if axes is None else axes
        if base is None:
            return Frame(self._axes @ np.array(place), axes @ self._axes.T)
        return Frame(base.origin + base.axes.T @ np.array(place), axes @ base.axes)

    def _base(self, component: Component) -> Frame | None:
        """Frame that the component's place is given in; None for the file's own."""
        named = number([component], "reference_component_for_position", "none")
        other = None if named is None else self.document.components.get(round(named.value))
        if other is None or other is component or other.kind == "gear_unit":
            return None
        return self.of(other)

    def _on_shaft(self, component: Component) -> Frame | None:
        shaft = self.shaft(component)
        frame = None if shaft is None else self.of(shaft)
        along = number([component], "u_coordinate_on_shaft", "mm")
        if frame is None or along is None:
            return None
        return Frame(frame.origin + along.value * frame.axes[0], frame.axes)


def _axes(component: Component) -> Array | None:
    """Rows u, v = w × u, w of a component's own axes, unit vectors; None where it has none."""
    u, w = vector(component, "u_axis_vector"), vector(component, "w_axis_vector")
    if u is None or np.linalg.norm(u) == 0:
        return None
    first = np.array(u) / np.linalg.norm(u)
    third = np.array((0.0, 0.0, 1.0) if w is None else w)
    third = third - (third @ first) * first
    if np.linalg.norm(third) < _ALONG:
        third = np.cross(first, (0.0, 1.0, 0.0))
    third /= np.linalg.norm(third)
    return np.array([first, np.cross(third, first), third])
