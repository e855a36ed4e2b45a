"""Planet carrier: two side plates, webs, pins, hub and bearing seats."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from flexgear.model.fe_mesh_source import FeMeshSource
from flexgear.model.section import Refusal, Section
from flexgear.model.units import Length


class Seat(Section):
    """A bearing seat on the carrier.

    diameter: of the seat; width: along the axis.
    """

    diameter: Length = Field(ge=5e-3, le=10.0)
    width: Length = Field(ge=1e-3, le=2.0)


class Carrier(FeMeshSource):
    """Along the axis from the drive side: hub with seat_drive, plate, gap with pins and webs,
    plate, seat_far.

    flexible: false makes it rigid with the same mass. drive_side: where the drive is bolted on.
    plate_diameter: of both plates. plate_thickness_drive, plate_thickness_far: of the plate on the
    drive side, on the far side. plate_gap: between the plates, wider than the gears. web_width: at
    the plates' edge. web_inner_radius: where webs begin; follows from the hub's bore if left out.
    web_clearance: from the webs to the planets' tips. pin_diameter, pin_bore: outer and inner of
    the planets' pins. pin_seat_width: of the planet bearing on the pin; all between the plates if
    left out. hub_outer_diameter, hub_bore: of the hub on the drive side. hub_length: from the plate
    on, the seat included. seat_drive, seat_far: bearing seats. fixed_interface_modes: number kept
    in the reduction.
    """

    flexible: bool = True
    drive_side: Literal["-z", "+z"]
    plate_diameter: Length = Field(ge=1e-2, le=10.0)
    plate_thickness_drive: Length = Field(ge=1e-3, le=1.0)
    plate_thickness_far: Length = Field(ge=1e-3, le=1.0)
    plate_gap: Length = Field(ge=1e-3, le=3.0)
    web_width: Length = Field(ge=1e-3, le=3.0)
    web_inner_radius: Length | None = Field(default=None, ge=1e-3, le=5.0)
    web_clearance: Length = Field(ge=1e-4, le=0.5)
    pin_diameter: Length = Field(ge=1e-3, le=2.0)
    pin_bore: Length = Field(default=0.0, ge=0.0, le=2.0)
    pin_seat_width: Length | None = Field(default=None, ge=1e-3, le=3.0)
    hub_outer_diameter: Length = Field(ge=5e-3, le=10.0)
    hub_bore: Length = Field(ge=1e-3, le=10.0)
    hub_length: Length = Field(ge=1e-3, le=5.0)
    seat_drive: Seat
    seat_far: Seat
    fixed_interface_modes: int = Field(default=120, ge=0, le=2000)

    @model_validator(mode="after")
    def _consistent(self) -> Carrier:
        if self.pin_bore >= self.pin_diameter:
            raise Refusal("pin_bore", "is as large as the pin", "lower it")
        return self
