"""Virtual strain gauges on an FE ring."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import Angle, Length


class Gauge(Section):
    """A strain gauge of no length on a ring's surface, on its outer surface or in a tooth root.

    name: stands behind that of the stage in results. angle: where it is on the outer surface, from
    the x axis of the ring's frame. tooth: number, from 1, of the tooth whose root fillet it is in,
    where a tangent makes 60° with the tooth's middle line (ISO 6336-3). side: of that tooth,
    towards lower or higher angles; a planet that a carrier moves to higher angles presses the
    -theta side. z: from mid-face. direction: in which it measures: 0 along the circumference (in a
    root along the tooth's profile), 90° along the axis or the tooth.
    """

    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")
    angle: Angle | None = None
    tooth: int | None = Field(default=None, ge=1)
    side: Literal["-theta", "+theta"] = "-theta"
    z: Length = 0.0
    direction: Angle = 0.0

    @model_validator(mode="after")
    def _one_place(self) -> Gauge:
        if self.angle is None and self.tooth is None:
            remedy = "give angle for the outer surface, or tooth for a root"
            raise Missing("angle", "is missing, and so is tooth", remedy)
        if self.angle is not None and self.tooth is not None:
            raise Refusal("tooth", "stands beside angle", "keep one of both")
        if self.tooth is None and self.side != "-theta":  # the default, and what a dump holds
            raise Refusal("side", "is that of a tooth", "take it out, or give tooth, not angle")
        return self


def check_gauges(gauges: tuple[Gauge, ...], teeth: int, face_width: float) -> None:
    """Refusal for gauges beside a ring of so many teeth and that width, m, or named alike."""
    for i, gauge in enumerate(gauges):
        key = f"ring.gauges.{i}"
        if gauge.tooth is not None and gauge.tooth > teeth:
            raise Refusal(f"{key}.tooth", f"is {gauge.tooth}", f"the ring has {teeth} teeth")
        if abs(gauge.z) > face_width / 2:
            raise Refusal(
                f"{key}.z", "is beside the ring", f"at most {5e2 * face_width:g} mm from mid-face"
            )
        if gauge.name in [other.name for other in gauges[:i]]:
            raise Refusal(f"{key}.name", f"{gauge.name} is there already", "name each once")
