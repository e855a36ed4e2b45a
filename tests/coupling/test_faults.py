"""Faults of single teeth: sound limits, closed forms, plane FE, invariances, bad input."""

import math
import warnings

import numpy as np
import pytest
from cut_teeth.of_case import gear_of
from plane_crack import crack_compliance
from plane_teeth import load_at
from trains import STAGE, spur_pair, write

from flexgear import load_case, sweep
from flexgear.analysis.orbit import orbit_elements
from flexgear.gears.implausible import implausible
from flexgear.gears.power_flow import power_flow
from flexgear.gears.report import stage_report
from flexgear.model.errors import FlexgearError, InputError
from flexgear.solve.angles import stage_motions
from flexgear.solve.headlines.declaration import Findings
from flexgear.solve.headlines.ratings import FAULTS
from flexgear.solve.transient import fault_warnings
from flexgear.structures.fe_mesh.tooth_segment import SegmentDivisions
from flexgear.structures.tooth_influence import of_case

GEAR_MESH = 'model = "MODEL"\ncontact_law = "one-sided"\n'
PLANETARY = STAGE.format(planets=3, sun="1e8", helix=0)
PLANETARY = PLANETARY.replace('model = "constant"', f"{GEAR_MESH}slices = 8")
PLANETARY = PLANETARY.replace("face_width_mm = 60", "face_width_mm = 30")
PAIR = spur_pair(gear_mesh=f"{GEAR_MESH}path_only = true\nslices = 10")
RING_PITCH = 360 / 94
ANGLES = RING_PITCH * np.linspace(0.0, 4.0, 41)


@pytest.fixture
def stage(tmp_path):
    """A train with faults, as a user writes them: ``stage(text, "per_pair", *faults)``."""

    def stage_case(text, model, *faults):
        sections = "".join(f"[[faults]]\n{fault}\n" for fault in faults)
        return load_case(write(tmp_path, text.replace("MODEL", model) + sections))

    return stage_case


def forces(case, angles=ANGLES, torque=None):
    return case.assemble().static(angles, torque=torque)["gear_mesh_force"].to_numpy()


RING_SPALL = 'kind = "spall"\ngear = "ring"\ntooth = {}\nflank = "drive"\ndepth_um = 25'
PINION_CRACK = 'kind = "root_crack"\ngear = "pinion"\ntooth = 1\nflank = "drive"\ndepth_mm = 2'
SUN_CRACK = 'kind = "root_crack"\ngear = "sun"\ntooth = 16\nflank = "drive"\ndepth_mm = {}'


@pytest.mark.parametrize("model", ["per_pair", "face_load", "lumped"])
def test_faults_of_no_depth_change_nothing(stage, model):
    sound = forces(stage(PLANETARY, model))
    faults = SUN_CRACK.format(0), RING_SPALL.format(3).replace("25", "0")
    assert np.abs(forces(stage(PLANETARY, model, *faults)) - sound).max() <= 1e-12 * sound.max()


def test_perfect_gears_have_no_faults_and_runs_last_until_a_faulty_tooth_is_back(stage):
    faulty = stage(PLANETARY, "per_pair", SUN_CRACK.format(2).replace("root_crack", "spall"))
    sound, model = stage(PLANETARY, "per_pair"), faulty.assemble()
    assert np.array_equal(model.without_errors().static(ANGLES)["gear_mesh_force"], forces(sound))
    cycles = [stage_motions(c, power_flow(c))[0].turn.cycle.gear_meshes for c in (sound, faulty)]
    assert cycles == [1, 26]


def test_steady_states_of_a_gear_mesh_period_leave_faults_out_and_say_so(stage):
    """A fault comes once a turn: it is for equilibria and transients."""
    cases = stage(PLANETARY, "per_pair"), stage(PLANETARY, "per_pair", RING_SPALL.format(3))
    sound, faulty = (orbit_elements(c.assemble().modal, 0, 32) for c in cases)
    assert np.array_equal(sound.parameters, faulty.parameters)
    assert np.array_equal(sound.offset, faulty.offset)
    assert {*faulty.left_out} - {*sound.left_out} == {"faults of teeth"}


def test_the_first_screen_names_the_stage_of_a_fault_in_a_train():
    case = load_case("grc-750kw").with_(
        faults=({"kind": "missing_tooth", "stage": "lss", "gear": "sun", "tooth": 5},)
    )
    (answer,) = FAULTS.answers(Findings(case, power_flow(case), {}))
    assert answer.sentence.startswith("lss: missing tooth of sun, tooth 5. Not assessed")


def test_faults_change_like_other_keys(stage):
    """By their place, as sweeps do."""
    case = stage(PLANETARY, "per_pair", SUN_CRACK.format(2), RING_SPALL.format(3))
    changed = case.with_(**{"faults.0.depth": 1e-3, "stage.planets": 1})
    assert [fault.deepest for fault in changed.faults] == [1e-3, 25e-6]
    assert not case.with_(faults=()).faults


@pytest.mark.parametrize("model", ["per_pair", "face_load"])
def test_the_next_tooth_has_its_fault_one_pitch_later(stage, model):
    """And only some of the angles see it."""
    sound = forces(stage(PLANETARY, model))
    one, next_one = (forces(stage(PLANETARY, model, RING_SPALL.format(j))) for j in (3, 4))
    assert next_one[10:] == pytest.approx(one[:-10], rel=1e-7)
    seen = np.abs(one - sound).max(axis=1) > 1e-3 * sound.max()
    assert 0.1 < seen.mean() < 0.9


@pytest.mark.parametrize("model", ["per_pair", "face_load"])
def test_a_missing_tooth_carries_nothing(stage, model):
    fault = 'kind = "missing_tooth"\ngear = "sun"\ntooth = 16'
    sound = stage(PLANETARY, model).assemble().static(ANGLES)
    faulty = stage(PLANETARY, model, fault).assemble().static(ANGLES)
    of_sun = (sound["flank_kind"] == "sun").to_numpy()
    for data, touches in ((sound, True), (faulty, False)):
        tooth = data["pair_tooth"].to_numpy()[:, of_sun]
        assert (tooth == 16).any() == touches
    for data in (sound, faulty):  # the others take its load
        torque = data["port_torque"].to_numpy()
        assert torque[:, 1] == pytest.approx(torque[0, 1], rel=1e-9)


MISSING = 'kind = "missing_tooth"\ngear = "sun"\ntooth = 16'
TIP_PIT = RING_SPALL.format(3) + "\nstart_diameter_mm = 368\nend_diameter_mm = 369"


@pytest.mark.parametrize(
    ("text", "model", "fault", "lost"),
    [
        (PLANETARY, "per_pair", MISSING, True),
        (PLANETARY, "lumped", MISSING, True),
        (PLANETARY, "per_pair", RING_SPALL.format(3), True),  # gear meshes deflect by 10 µm
        (PLANETARY, "per_pair", RING_SPALL.format(3).replace("25", "4"), False),
        (PLANETARY, "per_pair", f"{RING_SPALL.format(3)}\nface_end_mm = 5", False),
        (PLANETARY, "per_pair", TIP_PIT, False),  # where two pairs carry
        (PLANETARY, "face_load", MISSING, False),
        (PLANETARY.replace("slices", "path_only = true\nslices"), "face_load", MISSING, True),
        (PLANETARY.replace("angle_deg = 0", "angle_deg = 25"), "per_pair", MISSING, False),
    ],
)
def test_transients_warn_where_a_faulty_tooth_leaves_none_in_contact(
    stage, text, model, fault, lost
):
    """With a contact ratio below two, no tips off the path, and a fault of the whole face where one
    pair carries, deeper than the deflection of the gear mesh."""
    case = stage(text, model, fault)
    with warnings.catch_warnings(record=True) as issued:
        warnings.simplefilter("always")
        case.assemble().transient(2e-3)
    texts = [str(w.message) for w in issued if "alone on the path" in str(w.message)]
    assert len(texts) == lost
    assert all("face_load" in line for line in texts)
    assert texts == [line for line in implausible(case, power_flow(case)) if line in texts]


@pytest.mark.parametrize(
    ("text", "model", "gear", "share", "warned"),
    [
        (PLANETARY, "per_pair", "ring", 1.1, ["ring"]),
        (PLANETARY, "per_pair", "ring", 0.9, []),
        (PLANETARY, "per_pair", "planet", 1.1, ["ring", "sun"]),
        (PLANETARY, "face_load", "ring", 1.1, []),
        (PLANETARY.replace("angle_deg = 0", "angle_deg = 25"), "per_pair", "ring", 1.1, []),
        (PAIR, "per_pair", "sun", 1.1, ["pinion"]),
    ],
)
def test_pitch_deviations_of_spur_gears_that_exceed_the_deflection_have_the_warning(
    stage, text, model, gear, share, warned
):
    """Three standard deviations of the difference of two pitches beside the deflection of the gear
    mesh of the largest, by force and mean stiffness that ``check`` prints."""
    sound = stage(text, model)
    (flow,) = power_flow(sound).stages
    report = stage_report(sound.view(flow.name), flow.gear_mesh_forces)
    deflection = {
        role: force
        / report.get(f"{role}_gear_mesh", report.get("gear_mesh"))["mean_stiffness_n_per_m"]
        for role, force in flow.gear_mesh_forces.items()
    }
    of_gear = deflection.get(gear, max(deflection.values()))
    deviation = {f"stages.0.errors.{gear}_pitch": share * of_gear / (3.0 * math.sqrt(2.0))}
    case = sound.with_(**deviation)
    texts = [line for line in implausible(case, power_flow(case)) if "pitches at the" in line]
    assert sorted(line.split("pitches at the ")[1].split()[0] for line in texts) == warned
    assert all("face_load" in line for line in texts)
    assert fault_warnings(case.assemble()) == texts


@pytest.mark.parametrize(
    ("gear", "which", "contacts"),
    [("sun", "drive", 3), ("ring", "drive", 3), ("planet", 'sun"\nplanet = 2 # "', 1),
     ("planet", "", 2)],
)  # fmt: skip
def test_a_run_that_may_end_before_a_faulty_tooth_is_in_contact_has_a_warning(
    stage, gear, which, contacts
):
    """A tooth of sun or ring meets three planets in a turn, one flank of a planet one gear, a
    missing tooth of a planet both."""
    fault = RING_SPALL.format(3).replace("ring", gear).replace("drive", which)
    fault = fault if which else 'kind = "missing_tooth"\ngear = "planet"\nplanet = 2\ntooth = 3'
    model = stage(PLANETARY, "face_load", fault).assemble()
    teeth = getattr(model.case.stages[0], gear).teeth
    every = teeth / contacts / model.flow.stages[0].gear_mesh_frequency
    for duration, warned in ((0.99 * every, 1), (1.01 * every, 0)):
        texts = fault_warnings(model, duration)
        assert len(texts) == warned
        assert all(f"every {every:.3g} s" in text for text in texts)


def test_points_of_a_sweep_have_the_warning_where_the_fault_is_deep(stage, tmp_path):
    stage(PLANETARY, "per_pair", RING_SPALL.format(3))
    depths, short = {"faults.0.depth_um": [0.0, 4.0, 30.0]}, {"solver.duration_s": 2e-3}
    data = sweep(
        tmp_path / "train.toml", depths, settings=short, measures=["transient_forces"], workers=1
    )
    texts = data["warning"].to_numpy().tolist()
    assert ["alone on the path" in text for text in texts] == [False, False, True]
    assert ["may not contain the fault" in text for text in texts] == [False, True, True]


@pytest.mark.parametrize("model", ["per_pair", "face_load"])
@pytest.mark.parametrize("gear", ["pinion", "gear"])
def test_a_tooth_that_would_be_alone_at_the_start_may_be_missing(stage, model, gear):
    """Tooth 1 is at the pitch point at angle zero; modes are those of sound teeth, but for the
    tables of contact off the path, which reach further beside a missing tooth."""
    fault = MISSING.replace("sun", gear).replace("16", "1")
    text = PAIR.replace("path_only = true\n", "")
    sound, faulty = (stage(text, model, *f).assemble().modes() for f in ((), (fault,)))
    assert faulty["frequency"].to_numpy() == pytest.approx(sound["frequency"].to_numpy(), rel=1e-4)


def test_a_gear_pair_whose_only_tooth_is_missing_has_no_equilibrium_without_tips(stage):
    """Where one pair would be on the path of contact, and its tooth is missing."""
    fault, angles = 'kind = "missing_tooth"\ngear = "gear"\ntooth = 5', np.linspace(0.0, 360.0, 721)
    text = PAIR.replace("path_only = true\n", "")
    with pytest.raises(FlexgearError, match="a faulty tooth may leave none in contact; use"):
        stage(text, "per_pair", fault).assemble().static(angles)
    with pytest.raises(FlexgearError, match=r"none in contact; use .* without path_only"):
        stage(PAIR, "face_load", fault).assemble().static(angles)
    data = stage(text, "face_load", fault).assemble().static(angles)
    force = data["gear_mesh_force"].to_numpy()[:, 0]
    np.testing.assert_allclose(force, force[0], rtol=1e-6)


def flank_gap(turned, teeth, module):
    """Least distance, by rotation of a gear at its base circle, between a flank of that and one of
    its mate; turned: rotation of the first gear from contact at the pitch point, rad; teeth of
    both, addendum of one module, 20°."""
    alpha = math.radians(20)
    pitch = module * np.array(teeth) / 2
    base, tip, least = pitch * math.cos(alpha), pitch + module, np.inf
    turns = turned, -turned * teeth[0] / teeth[1]

    def involute(radius, k):
        roll = np.sqrt(radius**2 / base[k] ** 2 - 1)
        return turns[k] + roll - np.arctan(roll) - math.tan(alpha) + alpha

    for k in (0, 1):
        radius = np.linspace(1.0001 * base[k], tip[k], 20_001)
        angle = involute(radius, k)
        x, y = pitch.sum() - radius * np.cos(angle), -radius * np.sin(angle)
        mate = np.hypot(x, y)
        within = (mate <= tip[1 - k]) & (mate >= base[1 - k])
        turn = involute(mate[within], 1 - k) - np.arctan2(y, x)[within]
        least = min(least, base[1 - k] * turn.min(initial=np.inf))
    return least


def test_beside_a_missing_tooth_tips_touch_wherever_involutes_do(stage):
    """Under next to no load the gears approach by the least gap of the pairs on both sides."""
    fault = 'kind = "missing_tooth"\ngear = "pinion"\ntooth = 3'
    text = PAIR.replace("path_only = true\n", "")
    pitch, angles = (
        6.0,
        np.linspace(10.0, 14.0, 81),
    )  # of the gear, tooth 3 at the pitch point at 12°
    data = stage(text, "face_load", fault).assemble().static(angles, torque=1.0)
    approach = np.nan_to_num(data["unloaded_transmission_error"].to_numpy()[:, 0], nan=np.inf)
    exact = np.array([
        min(flank_gap(math.radians(2 * (angle - 12.0) + side * 2 * pitch), (30, 60), 4e-3)
            for side in (-1, 1))
        for angle in angles
    ])  # fmt: skip
    assert exact.max() > 2e-5
    np.testing.assert_allclose(approach, exact, atol=2e-2 * exact.max())


@pytest.mark.parametrize("model", ["per_pair", "face_load"])
@pytest.mark.parametrize("gear", ["pinion", "gear"])
def test_a_pit_takes_load_off_its_pair_as_two_springs_say(stage, model, gear):
    """Even over flank and face, and shallower than the deflection: δ = (F + k₁ d)/(k₁ + k₂)."""
    depth, angles = 3e-6, np.linspace(-3.0, 3.0, 25)
    fault = f'kind = "spall"\ngear = "{gear}"\ntooth = 1\nflank = "drive"\ndepth_um = 3'
    data = [stage(PAIR, model, *f).assemble().static(angles) for f in ((), (fault,))]
    name = "pair_tooth" if gear == "pinion" else "pair_planet_tooth"
    stiffness, load = (data[1][n].to_numpy() for n in ("pair_stiffness", "pair_load"))
    place = np.nan_to_num(data[0]["pair_position"].to_numpy())
    seen = 0
    for t in range(len(angles)):
        touching = load[t] > 0.0
        total, k = load[t].sum(), np.nansum(np.where(touching, stiffness[t], 0.0))
        if gear == "pinion" or model == "face_load":
            of_tooth = data[1][name].to_numpy()[t] == 1
        else:  # the pair that touches at the pitch point at angle zero
            of_tooth = data[1]["pair_tooth"].to_numpy()[t] == 1
        d = np.where(of_tooth, depth, 0.0)
        approach = (total + np.nansum(np.where(touching, stiffness[t] * d, 0.0))) / k
        expected = np.where(touching, stiffness[t] * (approach - d), 0.0)
        assert np.nan_to_num(load[t]) == pytest.approx(np.nan_to_num(expected), rel=1e-6)
        seen += int((of_tooth & touching).any() and touching.sum() > 1)
    assert seen > 3 and place.any()


def test_a_pit_of_a_whole_flank_is_the_same_on_either_tooth_of_a_pair(stage):
    """Also while tips touch before and after the path: the tip edge is as deep as the flank."""
    angles = np.linspace(-12.0, 12.0, 193)  # of the gear: two pitches about the pitch point
    text, loads = PAIR.replace("path_only = true\n", ""), []
    for gear in ("pinion", "gear"):
        fault = RING_SPALL.format(1).replace('"ring"', f'"{gear}"')
        data = stage(text, "face_load", fault).assemble().static(angles, torque=200.0)
        both = (data["pair_tooth"] == 1) & (data["pair_planet_tooth"] == 1)
        loads.append(np.where(both, data["pair_load"], 0.0).sum(axis=(1, 2)))
        assert data["unloaded_transmission_error"].max() > 5e-6  # others do not carry everywhere
    assert loads[0] == pytest.approx(loads[1], abs=1e-6 * loads[1].max())


@pytest.mark.slow
def test_a_crack_softens_its_pair_as_plane_finite_elements_say(stage):
    """Change of the compliance of the pair at the pitch point; the same crack in triangles, of a
    tooth that was cut by brute force. Between plane strain and plane stress: (1 − ν²) apart."""
    depth = 2e-3
    cases = stage(PAIR, "per_pair"), stage(PAIR, "per_pair", PINION_CRACK)
    stiffness = []
    for case in cases:
        data = case.assemble().static([0.0])
        first = data["pair_tooth"].to_numpy()[0] == 1
        stiffness.append(float(data["pair_stiffness"].to_numpy()[0][first].max()))
    view = cases[0].view()
    gear, module = gear_of(view, "sun"), view.stage.normal_module
    radius = 30 * module / 2
    (plane,) = crack_compliance(
        gear, [load_at(gear, radius, 0.05 * module)], 2.1e11, 0.3,
        held=4 * module, size=0.25 * module, depth=depth, angle=math.radians(60),
    )  # fmt: skip
    added = (1 / stiffness[1] - 1 / stiffness[0]) * view.stage.face_width
    assert added == pytest.approx(plane, rel=0.1)
    assert stiffness[1] < 0.95 * stiffness[0]


def test_a_crack_is_closed_under_the_other_flank(stage):
    sound, cracked = stage(PAIR, "per_pair"), stage(PAIR, "per_pair", PINION_CRACK)
    for torque, differs in ((500.0, True), (-500.0, False)):
        loads = [c.assemble().static([0.0, 3.0], torque=torque) for c in (sound, cracked)]
        k, k_cracked = (
            np.where(data["pair_load"] > 0.0, data["pair_stiffness"], 0.0) for data in loads
        )
        assert (np.abs(k_cracked - k).max() > 0.01 * k.max()) == differs
        assert differs or np.array_equal(k, k_cracked)


@pytest.mark.slow
@pytest.mark.parametrize(("gear", "torque"), [("pinion", 500.0), ("gear", -500.0)])
def test_the_end_of_the_face_that_is_cracked_yields(stage, gear, torque, monkeypatch):
    """Places along the face count along +z on every flank, though segments are made of one."""
    coarse = SegmentDivisions(flank=3, fillet=4, rim=3)
    monkeypatch.setattr(of_case, "CRACK_DIVISIONS", coarse)
    flank = "drive" if torque > 0 else "coast"
    fault = f'kind = "root_crack"\ngear = "{gear}"\ntooth = 1\nflank = "{flank}"\n'
    fault += "face_mm = [5, 20]\ndepths_mm = [2, 3]"
    data = [
        stage(PAIR, "face_load", *faults).assemble().static([0.0], torque=torque)
        for faults in ((), (fault,))
    ]
    line, z = (data[1][name].to_numpy()[0] for name in ("line_load", "slice_position"))
    change = line - data[0]["line_load"].to_numpy()[0]
    loaded = np.nan_to_num(line).sum(axis=-1) > 0.0
    low, high = (np.nanmean(np.where(side, change, np.nan)[loaded]) for side in (z < 0, z > 0))
    assert high < 0.0 < low


def test_a_planets_fault_repeats_with_its_teeth_and_turns_with_its_pass(stage):
    """Tooth 5 of planet 2 meets the ring once a turn of the planet in the carrier, z_r/z_p = 47/17
    times a turn of the carrier. The ring moves by that order and its multiples as seen from the
    carrier, and with sidebands of the carrier's turn for one who stands still."""
    fault = 'kind = "spall"\ngear = "planet"\nplanet = 2\ntooth = 5\nflank = "ring"\ndepth_um = 25'
    turns, passes = 17, 47
    angles = np.arange(2 * turns * 94) * RING_PITCH / 2
    motion = []
    for case in (stage(PLANETARY, "per_pair"), stage(PLANETARY, "per_pair", fault)):
        moved = case.assemble().static(angles)["body_displacement"].sel(body="stage.ring")
        motion.append(moved.sel(dof="ux").to_numpy() + 1j * moved.sel(dof="uy").to_numpy())
    turning = motion[1] - motion[0]
    standing = (turning * np.exp(1j * np.radians(angles))).real
    order = np.round(np.fft.fftfreq(len(angles), 1 / len(angles))).astype(int)  # per 17 turns
    for signal, sidebands in ((turning, (0,)), (standing, (-turns, turns))):
        lines = np.abs(np.fft.fft(signal))
        expected = np.any([(order + side) % passes == 0 for side in sidebands], axis=0)
        assert lines[~expected].max() < 1e-8 * lines.max()
        assert (lines[expected] > 1e-2 * lines.max()).sum() > 10


CRACK = SUN_CRACK.format(2)
WEAR = 'kind = "wear"\ngear = "ring"\nflank = "drive"\ndepth_um = 20'


@pytest.mark.parametrize(
    ("fault", "key", "words"),
    [
        (CRACK.replace("tooth = 16", "tooth = 27"), "faults[0].tooth", "beyond the 26 teeth"),
        (CRACK.replace("tooth = 16", ""), "faults[0].tooth", "is missing"),
        (CRACK.replace("depth_mm = 2", ""), "faults[0].depth_mm", "is missing -- add depth_mm ="),
        (CRACK.replace("drive", "ring"), "faults[0].flank", "no flank 'ring'"),
        (CRACK.replace("sun", "pinion"), "faults[0].gear", "no pinion"),
        (CRACK.replace("sun", "planet").replace("drive", "sun"), "faults[0].planet", "is missing"),
        (CRACK + "\nplanet = 1", "faults[0].planet", "given for the sun"),
        (CRACK + "\nface_start_mm = 1", "faults[0].face_start", "not a key of the kind root_crack"),
        (CRACK.replace("depth_mm = 2", "face_mm = [0, 40]\ndepths_mm = [1, 2]"),
         "faults[0].face", "beyond the face"),
        (WEAR + "\nface_end_mm = 16", "faults[0].face_end", "beyond the face"),
        (WEAR + "\nstage = 'other'", "faults[0].stage", "is no stage"),
        (CRACK + '\n[[faults]]\nkind = "missing_tooth"\ngear = "sun"\ntooth = 16',
         "faults[1].tooth", "a missing tooth has no other fault"),
        (CRACK + "\n[[faults]]\n" + CRACK, "faults[1].tooth", "is cracked by faults.0 already"),
    ],
)  # fmt: skip
def test_faults_that_do_not_fit_are_one_line(stage, fault, key, words):
    with pytest.raises(InputError, match=r"^[^\n]+$") as caught:
        stage(PLANETARY, "per_pair", fault)
    assert key in str(caught.value) and words in str(caught.value)


@pytest.mark.parametrize(
    ("fault", "key", "words"),
    [
        (CRACK.replace("depth_mm = 2", "depth_mm = 8"),
         "faults[0].depth_mm", "of the root section"),
        (WEAR + "\nstart_diameter_mm = 300", "faults[0].start_diameter_mm", "outside the flank"),
        (WEAR.replace("depth_um", "depth_mm"), "faults[0].depth", "more than half of the tooth"),
    ],
)  # fmt: skip
def test_faults_beyond_their_tooth_are_one_line(stage, fault, key, words):
    case = stage(PLANETARY, "per_pair", fault)
    with pytest.raises(InputError, match=r"^[^\n]+$") as caught:
        case.assemble()
    assert key in str(caught.value) and words in str(caught.value)


@pytest.mark.parametrize("model", ["constant", "rectangular"])
def test_models_that_see_no_single_teeth_refuse_faults(stage, model):
    with pytest.raises(InputError, match="does not model single teeth"):
        stage(PLANETARY, model, WEAR)
