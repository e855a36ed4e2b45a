"""Modified flanks in coupled stages, what a gap does to motion and loads; wide gears."""

import math

import numpy as np
import pytest
from coupled import TORQUE, make_system
from stepped import energy_error, jump, stepped
from trains import stage_train, write
from two_gears import gears_text

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.line_loads import line_loads
from flexgear.analysis.modes import rows_at
from flexgear.coupling.build import build_system
from flexgear.coupling.kernels.elements import pair_rows
from flexgear.coupling.kernels.pairs import build_rows
from flexgear.coupling.modal import modal_system
from flexgear.coupling.pair_data import carrying_flanks
from flexgear.model.load import load_case

GAP = 12e-6


def gears(folder, model="per_pair", **overrides):
    """Pinion and gear with all modes kept; what is there overrides by TOML key of the stage."""
    path = write(folder, gears_text(model, backlash=60))
    settings = {f"stages.stage_1.{key}": str(value) for key, value in overrides.items()}
    helical = {"stages.stage_1.helix_angle_deg": "15", "stages.stage_1.planet_hand": '"right"'}
    return modal_system(build_system(load_case(path, {**helical, **settings})))


def approach(modal, angles, torque):
    """Approach of both bodies along N at mid-face (p,), m, and loads of all pairs."""
    equilibrium = revolution(modal, angles, torque)
    out = []
    for angle, eta in zip(angles, equilibrium.eta, strict=True):
        moved = modal.channel_modes @ eta
        rows, _ = rows_at(modal.system, angle)
        row = next(
            i for i in range(len(rows.coef)) if modal.system.pairs.carries[rows.row["owner"][i]]
        )
        at = 6 * rows.blocks[row, : rows.row["width"][row], None] + np.arange(6)
        coef = rows.coef[row, : rows.row["width"][row]].copy()
        coef[:, 3:5] = 0.0  # tilts, of a row at another z
        out.append((coef * moved[at]).sum())
    return np.array(out), equilibrium.pair_load


def uniform(gear, *flanks):
    """A table that lacks the same everywhere."""
    return {
        f"{gear}.modifications.{flank}.table":
        f"{{ roll_angles_deg = [20], z_mm = [0], gaps_um = [[{1e6 * GAP}]] }}"
        for flank in flanks
    }  # fmt: skip


@pytest.mark.parametrize("model", ["per_pair", "face_load"])
def test_a_uniform_gap_moves_the_transmission_error_by_itself(tmp_path, model):
    """Loads stay to the last digit that closure allows; bodies approach by g cosβ_b more."""
    angles, torque = np.linspace(0.0, 0.2, 7), 500.0
    settings = (
        {"gear_mesh.path_only": "true", "gear_mesh.slices": "5"} if model == "face_load" else {}
    )
    plain, loads = approach(gears(tmp_path, model, **settings), angles, torque)
    (system,) = (gears(tmp_path, model, **settings, **uniform("gear", "drive")),)
    moved, same = approach(system, angles, torque)
    cos_b = math.cos(math.atan(float(system.system.pairs.slope[0])))
    np.testing.assert_allclose(moved - plain, GAP * cos_b, rtol=1e-7)
    np.testing.assert_allclose(same, loads, rtol=0, atol=1e-7 * loads.max())


def test_the_flank_that_does_not_carry_lacks_nothing_that_is_felt(tmp_path):
    """Coast flanks under the rated torque; drive flanks under the other one."""
    angles = np.linspace(0.0, 0.2, 5)
    plain = gears(tmp_path)
    for torque, idle, felt in ((500.0, "coast", "drive"), (-500.0, "drive", "coast")):
        bare, _ = approach(plain, angles, torque)
        unfelt, _ = approach(gears(tmp_path, **uniform("pinion", idle)), angles, torque)
        moved, _ = approach(gears(tmp_path, **uniform("pinion", felt)), angles, torque)
        np.testing.assert_allclose(unfelt, bare, rtol=1e-9)
        assert np.abs(moved - bare).min() > 0.9 * GAP


SLOPES = {
    "sun.modifications.drive.helix_slope_um": "errors.sun_helix_slope_um",
    "ring.modifications.drive.helix_slope_um": "errors.ring_helix_slope_um",
    "planet.modifications.sun.helix_slope_um": "errors.planet_sun_helix_slope_um",
    "planet.modifications.ring.helix_slope_um": "errors.planet_ring_helix_slope_um",
}


@pytest.mark.parametrize(
    ("torque", "keys"), [*zip(("3000", "3000", "-3000", "-3000"), SLOPES.items(), strict=True)]
)
def test_a_helix_slope_error_is_the_modification_of_that_flank(tmp_path, keys, torque):
    """Line loads of slices and the bodies' own approach and tilt, for the drive flanks and, under
    the other torque in the run, for the coast flanks."""
    ground, error = keys
    options = {"gear_mesh.model": '"face_load"', "gear_mesh.slices": "7", "helix_angle_deg": "12",
               "gear_mesh.contact_law": '"one-sided"', "gear_mesh.path_only": "true"}  # fmt: skip
    value = "[20]" if "planet" in error else "20"
    results = []
    for key, amount in ((ground, "20"), (error, value), ("planets", "4")):
        settings = {f"stage.{k}": v for k, v in {**options, key: amount}.items()}
        modal = modal_system(build_system(stage_train(tmp_path, helix=12, **settings)))
        result = revolution(modal, np.array([0.0, 0.02]), float(torque))
        results.append((result, line_loads(result)))
    (a, x), (b, y), (plain, _) = results
    if ground.startswith("planet") or float(torque) > 0:
        assert np.abs(a.far_load - plain.far_load).max() > 1e-3 * plain.pair_load.max()
    scale = a.pair_load.max()
    np.testing.assert_allclose(a.pair_load, b.pair_load, rtol=0, atol=1e-6 * scale)
    for name, size in (("line_load", scale / 0.06), ("approach", 1e-5), ("tilt", 1e-4)):
        np.testing.assert_allclose(
            getattr(x, name), getattr(y, name), rtol=0, atol=1e-5 * size, err_msg=name
        )


def test_a_helix_slope_error_on_pairs_that_are_one_spring(tmp_path):
    """The slope at the centre of stiffness of the pair, as the modification's mean gap is."""
    options = {"gear_mesh.model": '"per_pair"', "gear_mesh.contact_law": '"one-sided"'}
    loads = []
    for key in (
        "planet.modifications.sun.helix_slope_um",
        "errors.planet_sun_helix_slope_um",
    ):
        value = "[60]" if "errors" in key else "60"
        settings = {f"stage.{k}": v for k, v in {**options, key: value}.items()}
        modal = modal_system(build_system(stage_train(tmp_path, helix=12, **settings)))
        loads.append(revolution(modal, np.linspace(0, 0.05, 4), 3000.0).pair_load)
    np.testing.assert_allclose(*loads, rtol=0, atol=2e-3 * loads[0].max())


KEYS = {"amount_um": "60", "length_mm": "12", "form": '"parabolic"'}


def keys(prefix, length="12"):
    relief = {**KEYS, "length_mm": length}
    return {f"{prefix}.modifications.tip_relief.{name}": value for name, value in relief.items()}


def lumped(folder, **changes):
    options = {"stage.gear_mesh.model": '"per_pair"', "stage.gear_mesh.contact_law": '"one-sided"'}
    return build_system(stage_train(folder, **options, **changes))


def flexible(_, **changes):
    return make_system(**{"stage.gear_mesh.contact_law": "one-sided"}, **changes)


def unmodified(system):
    pairs = system.pairs
    return system.with_(pairs=pairs._replace(gap_table=np.zeros_like(pairs.gap_table)))


@pytest.mark.parametrize("make", [lumped, flexible])
def test_relief_is_the_gap_of_each_pair_at_its_place(tmp_path, make):
    """The same loads as without it, but with teeth that lack as much as their pair's gap there."""
    system = make(tmp_path, **keys("stage.planet", "12" if make is flexible else "5"))
    pairs, angle = system.pairs, 0.037
    rows = pair_rows(pairs)
    theta = system.theta(np.array([angle]))
    clean = unmodified(system).pairs
    _, count = build_rows(pairs, rows, theta, carrying_flanks(pairs))
    bare = pair_rows(pairs)
    build_rows(clean, bare, theta, carrying_flanks(pairs))
    gap = bare.pair["error"][:count] - rows.pair["error"][:count]
    assert gap.max() > 20e-6 and gap.min() == 0.0
    short = clean.error_gear.copy()
    for q in range(count):
        short[rows.pair["gear_mesh"][q], rows.pair["tooth"][q]] -= gap[q]
    shifted = system.with_(pairs=clean._replace(error_gear=short))
    torque = system.rated_torque
    loads, expected, plain = (
        revolution(modal_system(s), np.array([angle]), torque).pair_load
        for s in (system, shifted, unmodified(system))
    )
    np.testing.assert_allclose(loads, expected, rtol=0, atol=1e-8 * expected.max())
    assert np.abs(loads - plain).max() > 1e-2 * plain.max()


def wide_lumped(folder):
    return lumped(folder, **{"stage.helix_angle_deg": "25", "stage.face_width_mm": "150"})


def wide_flexible(folder):
    return flexible(folder, **{"stage.helix_angle_deg": "30", "stage.face_width_mm": "470"})


@pytest.mark.parametrize("make", [wide_lumped, wide_flexible])
def test_pairs_of_a_wide_stage_share_the_force_of_their_gear_mesh(tmp_path, make):
    system = make(tmp_path)
    pairs = system.pairs
    angles = np.linspace(0.0, 2 * np.pi / pairs.gear_teeth.max(), 5)
    equilibrium = revolution(modal_system(system), angles, system.rated_torque)
    front = pairs.carries == 1
    load, tooth = equilibrium.pair_load[:, front], equilibrium.pair_tooth[:, front]
    reach = pairs.s_hi - pairs.s_lo + 2 * np.abs(pairs.slope) * pairs.half_face
    ratio = np.floor(reach / pairs.pitch)[front]
    at_work = (tooth >= 0).sum(axis=-1)
    assert at_work.max() > 4
    assert np.all((at_work == ratio) | (at_work == ratio + 1))
    for sample in tooth.reshape(-1, pairs.slots):
        entries = sample[sample >= 0]
        assert len(set(entries)) == len(entries)  # none is written over by another
    # sun and ring turn no planet: all pairs are in the balance of its moments
    moment = load.sum(axis=-1) * pairs.planet_arm[front]
    planets = pairs.planet_block[front]
    for block in set(planets):
        entries = moment[:, planets == block]
        assert np.abs(entries.sum(axis=1)).max() < 1e-8 * np.abs(entries).max()


def test_energy_closes_while_many_pairs_come_and_go():
    modal = modal_system(wide_flexible(None), 3000.0)
    run = stepped(modal, jump(TORQUE, 0.3 * TORQUE, 0.01), 0.04, 5e-5, 1e-3, track_energy=True)
    assert (run.pair_load > 0.0).sum(axis=-1).max() > 4
    assert energy_error(run) < 1e-2
