"""What ``report.html`` says of a run: its side of the page, and the place of every picture."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.results.report.case_rows import case_tables
from flexgear.results.report.tables import tables
from flexgear.results.report.wording import with_unit, words
from flexgear.solve.headlines import verdicts
from flexgear.views.report import Picture, Side

# what the name of a picture holds -> section, and what the picture shows
PLACES = (
    ("drawing_front", "geometry", "Gears and what holds them to scale, seen along the axis: "
     "teeth, bolts, pins and bores as the case gives them."),
    ("drawing_section", "geometry", "The upper half of the stage cut along its axis, to scale."),
    ("^flank_", "geometry", "Material missing on a flank, normal to it in the transverse section."),
    ("power_flow", "power", "Power that enters is above zero, power that leaves below."),
    ("(ring|sun)_tooth_loads", "meshes", "Each line is one tooth pair from its entry to its "
     "exit; the dashed line is what a split by stiffness alone would give it."),
    ("face_line_load", "face", "What all pairs of a gear mesh carry together at one place of the "
     "face; K_Hβ is the largest over the mean (ISO 6336-1)."),
    ("face_misalignment", "face", "How much closer flanks come at the +z end of the face than at "
     "the other, by the body or bearing whose tilt it is; lines go from least to largest."),
    ("face_contact_pattern", "face", "Where flanks touch, and how hard at most: load that leans to "
     "one end of the face tells of tilt or twist."),
    ("face_rows", "face", "One flank a tooth, face across and diameter upwards: the largest line "
     "load that each place sees in all positions; white is what no loaded line came across."),
    ("face_transmission_error", "face", "How far the gears stay behind where they would be if they "
     "were rigid and perfect; its swing is what is heard, order by order. Unloaded: by ground "
     "flanks alone."),
    ("face_stiffness", "face", "Slope of the force as all tooth pairs close alike, under load: of "
     "the teeth, without gear bodies."),
    ("root_stress", "face", "Stress in the fillets at the roots of the teeth. Left: over a turn, "
     "in the roots that carry with planet 1; right: along the face where it is largest. Above zero "
     "a fillet is stretched, where cracks grow; thin lines below: the fillets that are pressed."),
    ("engagement_map", "meshes", "Which teeth of the ring are in contact as the carrier turns."),
    ("transient_forces", "meshes", "Normal force of every gear mesh; equal lines share the load."),
    ("sharing", "sharing", "Each planet's share times the number of planets: 1 is an even share."),
    ("ring_star_turning", "deflections", "One planet spacing of the carrier: press to turn. "
     "Displacements are drawn larger as stated; gears are shown undeformed."),
    ("ring_star", "deflections", "The ring bends into a star with a point at each planet, which "
     "turns with the carrier. Displacements are drawn larger as stated."),
    ("ring_profile", "deflections", "Outward displacement round the ring, by angle."),
    ("radial_harmonics", "deflections", "The ring's shape taken apart into waves round the circle; "
     "with equal planets only multiples of their number may be there."),
    ("tooth_node|tooth_displacement_map", "deflections", "How a tooth of the ring moves while the "
     "planets pass it."),
    ("_3d$", "deflections", "Turn it with the mouse or a finger; colour is the size of the "
     "displacement, the shape is drawn larger as stated."),
    ("displacement", "deflections", "How far bodies move from where they would be without load."),
    ("spectrum", "dynamics", "Amplitudes of the gear-mesh force by frequency in orders of the "
     "gear mesh; sidebands stand beside an order by whole turns of the carrier."),
    ("_energy$", "dynamics", "Work that goes in, and where it goes; the rest is error of the time "
     "steps."),
    ("_speed$", "dynamics", "The carrier slows down as the torque changes, and settles again."),
    ("torque_step", "dynamics", "How the load sharing answers a sudden change of the torque."),
    ("_mode_shapes$", "modes", "Choose a mode, let it swing, turn it; colour is the displacement "
     "in per cent of the largest. A mode has no size of its own, so it is drawn to be seen."),
    ("modes", "modes", "Each mode by its frequency, and what share of its energy lies where."),
    ("campbell", "modes", "Frequencies over speed and what excites them. Equal planets excite only "
     "modes of the colour of the order; the others take errors."),
)  # fmt: skip
ELSEWHERE = ("dynamics", "")


def place_of(name: str) -> tuple[str, str]:
    """Section of a picture by its file name, and the sentence below it."""
    return next((rest for what, *rest in PLACES if re.search(what, name)), ELSEWHERE)  # type: ignore[return-value]


def side_of(
    case: Case,
    flow: PowerFlow,
    summary: Mapping[str, Any],
    pictures: Iterable[Picture],
    notes: Iterable[str] = (),
) -> Side:
    """All that the page says of one run."""
    return Side(
        name=case.title or case.name,
        lead=lead(case, flow, summary),
        verdicts=verdicts(case, flow, summary),
        tables=[*tables(case, flow, summary), *case_tables(case)],
        pictures=list(pictures),
        version=str(summary["version"]),
        content_hash=str(summary["content_hash"]),
        notes=list(notes),
    )


def lead(case: Case, flow: PowerFlow, summary: Mapping[str, Any]) -> str:
    """What was computed, on which machine."""
    stages = "; ".join(_stage(case, name) for name in (s.name for s in case.stages))
    ports = ", ".join(
        f"{words(name)} {with_unit(abs(flow.speed[name]), 'rad/s')}, "
        f"{with_unit(abs(torque), 'N m')}"
        for name, torque in flow.torque.items()
        if abs(flow.speed[name]) > 0
    )
    did = ["natural modes", "equilibria", "load sharing", "steady running in time"]
    drops = [with_unit(float(depth), "N m") for depth in summary["torque_steps"]]
    if drops:
        did.append("torque drops to " + ", ".join(drops))
    return (
        f"{stages}. {with_unit(flow.input_power, 'W')} in; {ports}. Bodies: {summary['variant']}. "
        f"Computed: {', '.join(did)}."
    )


def _stage(case: Case, name: str) -> str:
    """ "stage 1: planetary, 3 planets, 21/42/105 teeth, module 15 mm"."""
    stage = case.stage(name)
    gears = ("sun", "planet", "ring") if stage.kind == "planetary" else ("pinion", "gear")
    teeth = "/".join(str(getattr(stage, gear).teeth) for gear in gears)
    planets = f", {stage.planets} planets" if stage.kind == "planetary" else ""
    return (
        f"{words(name).capitalize()}: {stage.kind}{planets}, {teeth} teeth, normal module "
        f"{with_unit(stage.normal_module, 'm')}"
    )
