"""Coupled systems of the bundled stage on cheap bodies, shared by the tests."""

from cheap_bodies import cheap_carrier, cheap_ring

from flexgear.coupling.build import build_system
from flexgear.gears.geometry import stage_geometry
from flexgear.model.load import load_case
from flexgear.model.names import BodyName
from flexgear.structures.bodies import rigid_variant

TORQUE = 4e6
CLEAN = {  # no manufacturing errors
    "stage.errors.ring_tooth_um": "0",
    "stage.errors.planet_tooth_um": "0",
    "stage.errors.sun_tooth_um": "0",
}


def make_case(**overrides):
    """The bundled stage."""
    return load_case("wind-5mw", overrides={**CLEAN, **overrides}).view()


def make_bodies(case, *, drive_z=-0.6, bolt_z=0.215, stiffness=1.0):
    geometry = stage_geometry(case)
    ring = cheap_ring(
        case.stage.ring.teeth,
        geometry.ring.reference_radius,
        bolt_z=bolt_z,
        stiffness=stiffness,
        fits=[fit.z for fit in case.ring.fits],
    )
    carrier = cheap_carrier(
        case.stage.planets, geometry.center_distance, drive_z=drive_z, stiffness=stiffness
    )
    return named(case, ring=ring, carrier=carrier)


def named(stage, **values):
    """Values by the names of a stage's bodies."""
    return {BodyName.of(stage.name, part): value for part, value in values.items()}


def stage_system(stage, bodies, rigid=None):
    """A flexible stage alone, coupled; rigid: parts that do not bend, by default as the case has
    them."""
    bends = stage.flexible_bodies
    rigid = [n for n in bends if (n.part in rigid if rigid is not None else not bends[n].flexible)]
    parts = {  # what is rigid is the cheap body, not one of the case's sizes
        name: rigid_variant(body.as_body()) if name in rigid else body
        for name, body in bodies.items()
    }
    return build_system(stage.case, parts, rigid)


def make_system(rigid=(), *, bodies=None, **overrides):
    case = make_case(**overrides)
    return stage_system(case, bodies or make_bodies(case), rigid)


def shaped(result, name="pair_load"):
    """Gear-mesh arrays of a single stage as (p, kinds, planets, slots)."""
    values = getattr(result, name)
    planets = len({label.planet for label in result.modal.system.gear_meshes})
    return values.reshape(len(values), -1, planets, *values.shape[2:])
