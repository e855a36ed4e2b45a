"""A train as REXS components: ids of its shafts, materials and results by member."""

from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from flexgear.files.rexs import tables as table
from flexgear.files.rexs.outgoing import Outgoing, Place, located
from flexgear.gears.power_flow import PowerFlow
from flexgear.gears.rating.steels import allowable_stress
from flexgear.model.case import Case
from flexgear.model.names import GroupName
from flexgear.model.rating import GearRating
from flexgear.model.section import Refusal


@dataclass(kw_only=True)
class TrainOut(Outgoing):
    """The REXS model of a train, with the ids of its components.

    places: positions of members. unit, casing: ids. shafts, begins: id of the shaft of a member or
    planet, and where it begins along u, m. materials: ids by their attributes.
    ends: ids of the shafts behind the splines of suns, at which ports and joints act. gear_data:
    ids by gear meshes of one half and gear. bearings: ids by bearing.
    """

    case: Case
    flow: PowerFlow
    places: dict[str, Place]
    unit: int = 0
    casing: int = 0
    shafts: dict[str, int] = field(default_factory=dict)
    begins: dict[str, float] = field(default_factory=dict)
    ends: dict[str, int] = field(default_factory=dict)
    gear_data: dict[tuple[GroupName, str], list[int]] = field(default_factory=dict)
    bearings: dict[str, list[int]] = field(default_factory=dict)
    materials: dict[tuple[tuple[str, Any], ...], int] = field(default_factory=dict)

    def material(self, rating: GearRating) -> int:
        """Id of the material of a gear, which gears of the same steel share. Strengths that the
        case leaves to steel, grade and hardness are written as ISO 6336-5 has them."""
        steel = table.STEELS.get((rating.steel or "").removesuffix("_carbon"))
        attributes = {
            **table.written(self.case.material, table.MATERIAL),
            **table.written(rating, table.GEAR_STRENGTH),
            **({table.STEEL[0]: steel} if steel else {}),
        }
        for place, row in zip(("flank", "root"), table.GEAR_STRENGTH, strict=False):
            with suppress(Refusal):  # of a hardness that the standard has no strength for
                strength = allowable_stress(rating, place)
                attributes |= {} if strength is None else {row.names[0]: strength}
        key = tuple(attributes.items())
        if key not in self.materials:
            self.materials[key] = self.add("material", rating.steel or "steel", **attributes)
        return self.materials[key]

    def shaft(self, member: str, place: Place, whole: int) -> int:
        """Add the shaft of a member or planet that begins at ``place``; returns its id."""
        port = self.case.port_at(member)
        defines = None if port is None else port.speed is not None
        number = self.part(whole, "shaft", member, **located(place), defines_speed=defines)
        self.shafts[member], self.begins[member] = number, place[0]
        return number

    def end(self, member: str) -> int:
        """Id of the shaft of a member at which ports and joints act."""
        return self.ends.get(member, self.shafts[member])
