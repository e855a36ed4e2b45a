"""The image of a stage in the plane of x and the axis carries the mirrored loads.

The image of a point of planet i at θ is one of planet −i at −θ; that of tooth j is tooth −j's other
flank. Hand, torque, speed, angles and errors are mirrored, keys along z and those of flanks that
carry stay. One thing no key mirrors: backlash is taken off coast flanks, and that is what the
image's drive flanks would lack. With the ring's backlash j that turns all gears of the image on
their carrier, and with rigid gears the whole stage is only turned, by j / (r_b,r cos β_b). Teeth of
an FE ring have nodes that do not turn, so there the other flanks are thinned.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from train_contexts import coarse_teeth
from turning_ring import STANDS, SUPPORT, cheap, held_case, lumped

from flexgear.analysis import gear_mesh_cycle
from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.line_loads import line_loads
from flexgear.analysis.modes import modes
from flexgear.analysis.recovery import Recovery
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.structures.fe_mesh.tooth_segment import SegmentDivisions
from flexgear.structures.tooth_influence import of_case as influence_pairs

PLANETS, TEETH = 5, {"ring": 93, "sun": 27, "planet": 33}
TORQUE, BACKLASH = 9e5, 0.5e-3  # N·m; m, of the bundled stage at ring and sun
ANGLES = np.array([0.0, 0.7, 5.0])  # of the sun, rad
ERRORS = {
    "pin_tangential": [30.0, 0.0, -10.0, 5.0, 0.0], "pin_radial": [0.0, 12.0, 0.0, -20.0, 0.0],
    "planet_eccentricity": [10.0, 5.0, 0.0, 8.0, 3.0],
    "planet_eccentricity_phase": [0.0, 80.0, 10.0, 200.0, 300.0],
    "sun_eccentricity": 30.0, "sun_eccentricity_phase": 40.0, "ring_eccentricity": 25.0,
    "ring_eccentricity_phase": 100.0, "carrier_eccentricity": 20.0,
    "carrier_eccentricity_phase": 200.0, "ring_offset": 15.0, "ring_offset_phase": 70.0,
}  # fmt: skip
ODD = ("pin_tangential", *(name for name in ERRORS if name.endswith("phase")))
TURNS = {  # of a gear on the carrier for one radian of θ, against which its phase counts
    "sun_eccentricity_phase": TEETH["ring"] / TEETH["sun"],
    "planet_eccentricity_phase": -TEETH["ring"] / TEETH["planet"],
    "ring_eccentricity_phase": -1.0,
    "ring_offset_phase": -1.0,
}
MIRROR = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])  # of (u, ω), ω being an axial vector


def errors_as_keys(image, turn=0.0):
    """The same errors or their image's, planet i in the place of −i, in an image at −θ + turn."""
    settings = {}
    for name, values in ERRORS.items():
        sign = -1.0 if image and name in ODD else 1.0
        shift = -math.degrees(TURNS.get(name, 0.0) * turn)
        unit = "deg" if name.endswith("phase") else "um"
        if isinstance(values, list):
            values = [sign * values[-i if image else i] + shift for i in range(len(values))]
            settings[f"stage.errors.{name}_{unit}"] = str(values)
        else:
            settings[f"stage.errors.{name}_{unit}"] = str(sign * values + shift)
    return settings


def stage_modal(tmp_path, image, *parts, held="ring", turn=0.0, **more):
    """The stage whose sun is driven backwards onto drive flanks, or its image; parts: lumped."""
    sign, hand = (-1.0, "left") if image else (1.0, "right")
    more |= {**SUPPORT, **STANDS} if held == "carrier" else {}
    case = held_case(
        tmp_path, held, "sun", {"ring": "carrier", "carrier": "ring"}[held], torque=sign * TORQUE,
        speed=sign * 30.0, **{"stage.planet_hand": f'"{hand}"'},
        **errors_as_keys(image, turn), **more,
    )  # fmt: skip
    case = lumped(case, *parts)
    return modal_system(build_system(case, cheap(case)))


def thinned_on_the_other_flanks(image, original):
    """The image with phases and play of flanks as the mirror shows them."""
    image_pairs, pairs = image.system.pairs, original.system.pairs
    number = {(m.kind, m.planet): k for k, m in enumerate(original.system.gear_meshes)}
    seen = [number[mirrored(m.kind, m.planet, 0)[:2]] for m in image.system.gear_meshes]
    off = pairs.s0[seen] - image_pairs.s0
    off -= image_pairs.pitch * np.rint(off / image_pairs.pitch)
    changed = image_pairs._replace(s0=image_pairs.s0 + off, gap=pairs.gap[seen])
    return replace(image, system=image.system.with_(pairs=changed)), np.abs(off).max()


def mirrored(kind, planet, tooth):
    swapped = kind.removesuffix("_coast") if kind.endswith("_coast") else f"{kind}_coast"
    return swapped, -planet % PLANETS, -tooth % TEETH["ring"]


def loads_by_tooth(result):
    """By position the load of every ring tooth, and the sum of every sun gear mesh."""
    out = []
    for loads, teeth in zip(result.pair_load, result.pair_tooth, strict=True):
        by_tooth = {}
        for label, load, tooth in zip(result.modal.system.gear_meshes, loads, teeth, strict=True):
            if label.kind.startswith("sun"):
                by_tooth[label.kind, label.planet, 0] = float(load.sum())
                continue
            for f, j in zip(load, tooth, strict=True):
                if j >= 0:
                    by_tooth[label.kind, label.planet, int(j)] = float(f)
        out.append(by_tooth)
    return out


def assert_mirrored(original, image):
    """Tooth loads within 1e-8 of the largest, on the other flanks."""
    loads, image_loads = loads_by_tooth(original), loads_by_tooth(image)
    largest = max(load for position in loads for load in position.values())
    for a, b in zip(loads, image_loads, strict=True):
        seen = {mirrored(*key): load for key, load in a.items() if load > 1e-6 * largest}
        assert len(seen) > 2 * PLANETS
        assert all(abs(b.get(key, 0.0) - load) < 1e-8 * largest for key, load in seen.items())
        assert {key for key, load in b.items() if load > 2e-6 * largest} <= set(seen)
        assert not any(kind.endswith("_coast") for kind, _, _ in seen)


def assert_same_motion(original, image, ring="tooth_017", image_ring="tooth_078"):
    """Planets, sun, carrier and ring move as the mirror shows."""
    nodes = [("stage.shaft", "sun", "stage.shaft", "sun"),
             ("stage.carrier", "bearing_far", "stage.carrier", "bearing_far"),
             ("stage.ring", ring, "stage.ring", image_ring),
             *((f"stage.planet_{i + 1}",) * 2 + (f"stage.planet_{-i % PLANETS + 1}",) * 2
               for i in range(PLANETS))]  # fmt: skip
    for body, node, other, other_node in nodes:
        a, b = Recovery(original).node(body, node), Recovery(image).node(other, other_node)
        for part in (slice(0, 3), slice(3, 6)):
            close = 1e-8 * np.abs(a[:, part]).max()
            np.testing.assert_allclose((b * MIRROR)[:, part], a[:, part], rtol=0, atol=close)


@pytest.mark.parametrize("held", ["ring", "carrier"])
def test_an_fe_stage_with_the_other_flanks_thinned(tmp_path, held):
    original, plain = (stage_modal(tmp_path, image, held=held) for image in (False, True))
    image, moved = thinned_on_the_other_flanks(plain, original)
    cos_b = math.cos(math.atan(float(original.system.pairs.slope[0])))
    assert moved == pytest.approx(BACKLASH / cos_b, rel=1e-9)
    results = [
        revolution(modal, sign * ANGLES, sign * TORQUE)
        for modal, sign in ((original, 1), (image, -1))
    ]
    assert_mirrored(*results)
    assert_same_motion(*results)


def test_an_fe_ring_has_the_natural_frequencies_of_its_image(tmp_path, monkeypatch):
    """Slices that touch depend on the bolts near a tooth, so that positions have to be mirrored."""
    monkeypatch.setattr(gear_mesh_cycle, "POSITIONS", 10)
    face = {"stage.gear_mesh.model": '"face_load"', "stage.gear_mesh.slices": "3"}
    original, plain = (
        stage_modal(tmp_path, image, "sun", "carrier", **face) for image in (False, True)
    )
    image, _ = thinned_on_the_other_flanks(plain, original)
    lowest, seen = (
        modes(m.system, gear_mesh_cycle.mean_springs(m.system, m).stiffness, 500.0).frequencies
        for m in (original, image)
    )
    assert len(lowest) > 10
    np.testing.assert_allclose(seen, lowest, rtol=1e-7, atol=1e-3)


LUMPED = ("ring", "sun", "carrier")


def turned_image(tmp_path, **more):
    """A lumped stage and its image, which coast flanks of the ring turn: both at their angles."""
    original = stage_modal(tmp_path, False, *LUMPED, **more)
    pairs, kinds = original.system.pairs, [m.kind for m in original.system.gear_meshes]
    turn = -BACKLASH / abs(pairs.gear_arm[kinds.index("ring")])
    image = stage_modal(tmp_path, True, *LUMPED, turn=turn, **more)
    sun = turn * (1.0 + TEETH["ring"] / TEETH["sun"])
    return (
        revolution(original, ANGLES, TORQUE),
        revolution(image, -ANGLES + sun, -TORQUE),
    )


def test_a_lumped_stage_turned_by_the_play_of_its_planets(tmp_path):
    """Nothing is changed but the case's keys and the angle."""
    assert_mirrored(*turned_image(tmp_path))


FACE = {
    "gear_mesh.model": "face_load", "gear_mesh.slices": "7",
    "sun.modifications.drive.helix_slope_um": "15", "sun.modifications.coast.twist_um": "9",
    "planet.modifications.sun.tip_relief": "{ amount_um = 20, length_mm = 9 }",
    "planet.modifications.ring.lead_crowning_um": "12",
    "ring.modifications.drive.end_relief": '{ amount_um = 30, length_mm = 60, end = "+z" }',
    "ring.modifications.coast.profile_crowning_um": "6",
    "errors.planet_sun_helix_slope_um": "[20, 10, 0, 0, 10]",
}  # fmt: skip
COARSE = SegmentDivisions(flank=4, fillet=2, tooth=2, rim=2, layers=4)


@pytest.fixture(scope="module")
def influences(tmp_path_factory):
    """FE influences of teeth of the right-handed stage, on coarse segments."""
    folder = tmp_path_factory.mktemp("influences")
    stage = lumped(held_case(folder, "ring", "sun", "carrier"), *LUMPED)
    return coarse_teeth(stage.view(), COARSE)


@pytest.fixture(params=["width", "fe"])
def face(request, monkeypatch, influences):
    """Keys of modified flanks followed along the face, with springs of slices or FE influences."""

    def influence(view, slot):
        influence = influences[slot]
        return influence if view.stage.planet_hand == "right" else influence.mirrored()

    monkeypatch.setattr(influence_pairs, "tooth_influence", influence)
    compliance = {"gear_mesh.tooth_compliance": f'"{request.param}"'}
    return {f"stage.{key}": value for key, value in {**FACE, **compliance}.items()}


def slices(result):
    """Forces (pairs, K) by position and gear mesh, pairs by their place on the path."""
    force, forces = line_loads(result).force, {}
    for p, m in np.ndindex(force.shape[:2]):
        slots = np.flatnonzero(result.pair_tooth[p, m] >= 0)
        order = slots[np.argsort(result.pair_position[p, m, slots])]
        label = result.modal.system.gear_meshes[m]
        forces[p, label.kind, label.planet] = force[p, m, order]
    return forces


@pytest.mark.slow
def test_load_along_the_face_is_mirrored_slice_by_slice(tmp_path, face):
    original, image = turned_image(tmp_path, **face)
    assert_mirrored(original, image)
    forces, image_forces = slices(original), slices(image)
    largest = max(force.max(initial=0.0) for force in forces.values())
    for (p, kind, planet), force in forces.items():
        if kind.endswith("_coast"):  # those that carry
            seen = image_forces[p, *mirrored(kind, planet, 0)[:2]]
            np.testing.assert_allclose(seen, force, rtol=0, atol=1e-8 * largest)


def test_load_along_the_face_turns_with_the_planets_and_their_numbers(tmp_path, face):
    """A carrier one planet further, and errors that are the next planet's: its loads to the one
    before it. Planets roll without moment, the sun takes its torque."""
    step = 2 * np.pi / PLANETS * (1.0 + TEETH["ring"] / TEETH["sun"])
    pins = np.array(ERRORS["pin_tangential"])
    results = []
    for values, angle in ((pins, 0.7), (np.roll(pins, -1), 0.7 + step)):
        keys = {
            "errors.pin_tangential_um": values,
            "errors.planet_sun_helix_slope_um": values,
        }
        more = {**face, **{f"stage.{key}": str(v.tolist()) for key, v in keys.items()}}
        case = lumped(held_case(tmp_path, "ring", "sun", "carrier", **more), *LUMPED)
        results.append(revolution(modal_system(build_system(case)), np.array([angle]), TORQUE))
    one, next_ = results
    forces, next_forces = slices(one), slices(next_)
    largest = max(force.max(initial=0.0) for force in forces.values())
    for (p, kind, planet), force in next_forces.items():
        seen = forces[p, kind, (planet + 1) % PLANETS]
        np.testing.assert_allclose(force, seen, rtol=0, atol=1e-8 * largest)
    pairs, load = one.modal.system.pairs, one.pair_load[0].sum(axis=1)
    labels = one.modal.system.gear_meshes
    for planet in range(PLANETS):
        columns = [k for k, m in enumerate(labels) if m.planet == planet]
        assert abs(load[columns] @ pairs.planet_arm[columns]) < 1e-8 * TORQUE
    suns = [k for k, m in enumerate(labels) if m.kind.startswith("sun")]
    assert abs(load[suns] @ pairs.gear_arm[suns]) == pytest.approx(TORQUE, rel=1e-8)
