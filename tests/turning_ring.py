"""The bundled stage on cheap bodies with any member held, shared by tests of members that turn."""

from cheap_bodies import cheap_carrier, cheap_ring
from trains import STEEL, write

from flexgear.gears.geometry import stage_geometry
from flexgear.model.case import validated_case
from flexgear.model.load import load_case
from flexgear.model.read import Written

HUB = {"stage.ring.hub.kinematics": "torsional", "stage.ring.hub.inertia_kg_m2": "2000"}
SUPPORT = {  # a hub that moves, on a bearing
    "stage.ring.hub.kinematics": "spatial", "stage.ring.hub.mass_kg": "4000",
    "stage.ring.hub.inertia_kg_m2": "2000", "stage.ring.hub.tilt_inertia_kg_m2": "1200",
    "stage.ring.hub.bearing.radial_n_per_m": "3e9", "stage.ring.hub.bearing.axial_n_per_m": "2e9",
    "stage.ring.hub.bearing.tilt_nm_per_rad": "3e8",
}  # fmt: skip
STANDS = {"stage.carrier.bearing_drive.torsion_nm_per_rad": "5e10"}  # a carrier that is held
PERFECT = {f"stage.errors.{gear}_tooth_um": "0" for gear in ("ring", "planet", "sun")}
PORTS = """
held = ["stage.{held}"]
[[inputs]]
member = "stage.{first}"
speed_rpm = {speed}
torque_nm = {torque}
[output]
member = "stage.{second}"
"""


def held_case(tmp_path, held, first, second, *, torque=9e5, speed=30.0, more="", **overrides):
    """The bundled stage with perfect gears and one member held, or with ``more`` inputs."""
    ends = {}
    for at, member in (("inputs.0", first), ("output", second)):
        if member == "sun":  # what hangs behind its spline
            ends |= {f"{at}.mass_kg": "2000", f"{at}.tilt_inertia_kg_m2": "500"}
            ends |= {f"{at}.bearing.{d}_n_per_m": "3e9" for d in ("radial", "axial")}
            ends |= {f"{at}.bearing.tilt_nm_per_rad": "1e8", f"{at}.inertia_kg_m2": "4e4"}
        else:
            ends |= {f"{at}.inertia_kg_m2": "1e5"}
    ports = PORTS.format(held=held, first=first, second=second, torque=torque, speed=speed)
    text = ports.partition("[[")[0] + STEEL + '[stage]\ncase = "wind-5mw"\n'
    text += "[[" + ports.partition("[[")[2].replace("[output]", f"{more}[output]")
    text = text.partition("[material]")[1:] if more else [text]  # nothing is held
    return load_case(write(tmp_path, "".join(text)), {**PERFECT, **ends, **overrides})


def cheap(case, bolts=25):
    """Ring and carrier of springs for the only stage of a case."""
    view = case.view()
    radius, distance = (
        stage_geometry(view).ring.reference_radius,
        stage_geometry(view).center_distance,
    )
    bodies = {}
    for name, section in view.fe_bodies.items():
        if name.part == "ring":
            fits = [fit.z for fit in section.fits]
            bodies[name] = cheap_ring(view.stage.ring.teeth, radius, bolts=bolts, fits=fits)
        else:
            bodies[name] = cheap_carrier(view.stage.planets, distance)
    return bodies


def lumped(case, *parts):
    """The same with lumped members in place of FE bodies and shafts."""
    data = case.model_dump(mode="python")
    stage, ports = data["stages"][0], [*data["inputs"], data["output"]]
    for part in parts:
        turns = f"stage.{part}" not in data["held"]
        support = {"radial": 1e10, "axial": 5e9, "tilt": 5e8, "torsion": 0.0 if turns else 1e11}
        member = stage[part]
        if part == "sun":
            member["shaft"] = None
            support = {**support, "radial": 0.0 if turns else 1e9}
            for port in ports:
                if port["member"] == "stage.sun":
                    port.update(mass=None, tilt_inertia=None, bearing=None)
        if part == "carrier":
            member.update(fe=None, bearing_drive=None, bearing_far=None)
        if part == "ring":
            member.update(fe=None, hub=None)
        member["support"] = support
    return validated_case(data, "test", Written())
