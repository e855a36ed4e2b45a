"""Load along the face: even where nothing tilts; what misaligns adds up to what lines feel."""

import numpy as np
import pytest
import xarray as xr
from pinion_on_bearings import HELIX, A, B
from pinion_on_bearings import text as shaft_text
from stage_samples import cheap_stage
from train_contexts import rigid_stage
from trains import write

import flexgear as fg
from flexgear.analysis.line_loads import CAUSES
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.slices import with_ends
from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.model.stage import Stage
from flexgear.results.face_load import edge_warnings, face_figures, misalignment_of_groups
from flexgear.solve.model import assemble
from flexgear.solve.static import static
from flexgear.solve.transient import simulate
from flexgear.views.face_load_charts import along_face_chart, contact_pattern, misalignment_chart

BASE = load_case("wind-5mw")
CYCLE = 2 * np.pi / BASE.view().stage.ring.teeth * np.arange(12) / 12


def statics(**changes):
    case = BASE.with_(**{"stage.gear_mesh.model": "face_load", **changes})
    return static(rigid_stage(case), CYCLE)


@pytest.fixture(scope="module")
def stage():
    return statics()


def test_line_loads_add_up_along_the_contact_line_and_along_the_face(stage):
    width = BASE.view().stage.face_width
    load = stage["face_line_load"].to_numpy()
    along = width * 0.5 * (load[..., 1:] + load[..., :-1]).sum(axis=-1) / (load.shape[-1] - 1)
    force = stage["pair_load"].sum("slot").to_numpy()
    # places along the face do not know where lines end: a fraction of a place of each
    np.testing.assert_allclose(along, force, atol=0.02 * force.max())
    np.testing.assert_allclose(along.mean(axis=0), force.mean(axis=0), atol=2e-3 * force.max())


def spur(z):
    """K_Hβ and misalignment, µm, of gear meshes of straight teeth without errors; planet bearings
    at z, m, from mid-face."""
    clean = {f"stage.errors.{gear}_tooth": 0.0 for gear in ("ring", "planet", "sun")}
    figures = face_figures(
        statics(**{"stage.helix_angle": 0.0, "stage.planet_bearing.z": z, **clean})
    )
    return np.array([[f["k_h_beta"], f["misalignment_um"]] for f in figures.values()]).T


def test_rigid_flanks_of_one_slope_touch_at_the_end_of_the_face_at_every_angle():
    """Half of the slope along the normal, 20 µm cos β_b, without any ripple: some pair always
    touches there. tan β_b = tan β cos α_t."""
    clean = {f"stage.errors.{gear}_tooth": 0.0 for gear in ("ring", "planet", "sun")}
    stage = BASE.view().stage
    transverse = np.arctan(np.tan(stage.pressure_angle) / np.cos(stage.helix_angle))
    base_helix = np.arctan(np.tan(stage.helix_angle) * np.cos(transverse))
    slopes = {"stage.errors.planet_ring_helix_slope": (40e-6,) * 5}
    touch = statics(**clean, **slopes)["unloaded_transmission_error"]
    np.testing.assert_allclose(
        touch.sel(flank="stage ring 1 drive"), -20e-6 * np.cos(base_helix), atol=1e-8
    )


def test_straight_teeth_without_errors_or_tilt_are_loaded_evenly():
    factor, tilt = spur(0.0)
    assert np.abs(tilt).max() < 0.2  # the planets' bearings and the sun's spline are left
    assert factor == pytest.approx(1.0, abs=2e-3)


def test_tilt_raises_the_factor_in_proportion_while_the_whole_face_touches():
    """K = 1 + c f/(2 w): bearings off the middle tilt the planets."""
    (small, little), (large, more) = spur(4e-3), spur(8e-3)
    assert np.abs(little).min() > 2.0
    assert (large - 1) / (small - 1) == pytest.approx(more / little, rel=0.05)
    assert (small > 1.01).all()


def straight(**changes):
    """Straight teeth without errors but those given, on the path of contact alone, planet bearings
    at mid-face."""
    clean = {f"stage.errors.{gear}_tooth": 0.0 for gear in ("ring", "planet", "sun")}
    settings = {
        "stage.helix_angle": 0.0,
        "stage.planet_bearing.z": 0.0,
        "stage.gear_mesh.path_only": True,
    }
    return statics(**settings, **clean, **changes)


def test_pairs_of_perfect_straight_teeth_share_ideally():
    """K_Hα = 1, and at any instant the stiffest pair has n k/Σk times the mean line load."""
    data = straight()
    stiffness = data["pair_stiffness"]
    pairs = (stiffness > 0).sum("slot")
    expected = (pairs * stiffness.max("slot") / stiffness.sum("slot")).max("position")
    for name, one in face_figures(data).items():
        assert one["k_h_alpha"] == pytest.approx(1.0, abs=2e-3)
        least = float(expected.sel(flank=name))
        # the sun leans a little as the pairs change, to and fro
        assert least * (1 - 1e-6) <= one["instantaneous_peak_factor"] < 1.03 * least
        assert one["tip_line_load_n_per_mm"] == one["face_end_contact_positions"] == 0
    assert edge_warnings(face_figures(data)) == []


def test_pitch_deviations_make_pairs_share_unevenly():
    """Straight teeth have their largest load where one pair carries all of it; oblique ones not."""
    straight_ones = face_figures(straight(**{"stage.errors.sun_pitch": 30e-6})).values()
    assert all(abs(one["k_h_alpha"] - 1.0) < 2e-3 for one in straight_ones)
    oblique = statics(**{"stage.errors.sun_pitch": 30e-6, "stage.gear_mesh.path_only": True})
    uneven = {name: one["k_h_alpha"] for name, one in face_figures(oblique).items()}
    assert max(k for name, k in uneven.items() if " sun " in name) > 1.15
    assert max(k for name, k in uneven.items() if " ring " in name) < 1.1


def test_ends_of_the_face_are_flagged_where_a_tilted_tooth_leaves_its_other_end():
    """K = 1 + c f/(2 w) is 2 there, at the last slice's middle a little less."""
    less, more = (
        face_figures(straight(**{"stage.errors.ring_helix_slope": f})) for f in (15e-5, 3e-4)
    )
    one = less["stage ring 1 drive"]
    assert 1.5 < one["k_h_beta"] < 1.9
    assert one["face_end_contact_positions"] == 0
    one = more["stage ring 1 drive"]
    assert one["k_h_beta"] > 2.0
    assert one["face_end_contact_positions"] == 1
    (line,) = [x for x in edge_warnings(more) if "end of the face" in x]
    assert line.startswith("stage ring: an end of the face carries up to ")
    assert "more than twice the mean line load" in line


def test_tips_carry_until_they_are_relieved(stage):
    # 150 µm would do but for the slope, by which ½ ρ_eq g_y² less is left between internal flanks
    relief = {"amount": 200e-6, "length": 20e-3, "form": "linear"}
    keys = [f"planet.modifications.{f}" for f in ("sun", "ring")]
    keys += [f"{gear}.modifications.drive" for gear in ("sun", "ring")]
    relieved = statics(**{f"stage.{key}.tip_relief": relief for key in keys})
    for before, after in zip(
        face_figures(stage).values(), face_figures(relieved).values(), strict=True
    ):
        assert before["tip_load_share_max"] > 0.03
        assert after["tip_load_share_max"] == 0.0


def test_contact_pressure_is_that_of_hertz(stage):
    """p = √(w E' / (2π ρ)) with E' = E/(1 − ν²) of two equal bodies, normal section."""
    view = BASE.view()
    g, material = stage_geometry(view), view.material
    flank = stage.isel(position=3).sel(flank="stage sun 2 drive")
    at = int(np.nanargmax(flank["line_load"].values))
    w, s = (flank[name].values.ravel()[at] for name in ("line_load", "slice_path"))
    cos_b = np.cos(g.base_helix_angle)
    reach = g.center_distance * np.sin(g.sun_gear_mesh.working_angle)
    radius = s * (reach - s) / reach / cos_b
    modulus = material.young_modulus / (1 - material.poisson_ratio**2)
    pressure = np.sqrt(w * cos_b * modulus / (2 * np.pi * radius))
    assert flank["largest_contact_pressure"].item() >= pressure * (1 - 1e-9)
    assert flank["largest_contact_pressure"].item() == pytest.approx(pressure, rel=0.25)


def test_planets_of_a_stage_without_errors_are_loaded_alike():
    """Five planets see the same within a cycle: K_Hβ differs by the phase of the positions only."""
    figures = face_figures(
        statics(**{f"stage.errors.{g}_tooth": 0.0 for g in ("ring", "planet", "sun")})
    )
    for kind in ("ring", "sun"):
        k = [f["k_h_beta"] for name, f in figures.items() if f" {kind} " in name]
        assert len(k) == 5
        assert np.ptp(k) < 0.02 * max(k)


def test_more_positions_tell_the_same(stage):
    model = rigid_stage(BASE.with_(**{"stage.gear_mesh.model": "face_load"}))
    finer = static(model, np.linspace(0, CYCLE[1] * 12, 36, endpoint=False))
    one, two = face_figures(stage), face_figures(finer)
    for name in one:
        assert one[name]["k_h_beta"] == pytest.approx(two[name]["k_h_beta"], rel=0.01)


def in_time(**changes):
    case = BASE.with_(
        **{"stage.gear_mesh.model": "face_load", "stage.gear_mesh.slices": 5, **changes}
    )
    return simulate(rigid_stage(case), duration=2e-3).data


def test_line_loads_in_time_are_saved_on_request():
    """What all samples have follows from them; without it the rest is the same."""
    run, asked = in_time(), in_time(**{"solver.line_loads_in_time": True})
    assert np.isfinite(run["transmission_error"].sel(flank="stage ring 1 drive")).all()
    assert run["largest_line_load"].max() > 0
    assert "line_load" not in run
    xr.testing.assert_equal(asked[list(run)].drop_attrs(), run.drop_attrs())
    largest = with_ends(np.nan_to_num(asked["line_load"].to_numpy())).max(axis=(2, 3))
    np.testing.assert_allclose(largest, asked["largest_line_load"], rtol=1e-12)
    still = static(rigid_stage(BASE.with_(**{"stage.gear_mesh.model": "face_load"})), [0.0])
    assert set(still) - set(asked) == {"closure", "rim_stress"}


def test_pictures_are_drawn(stage):
    for chart in (along_face_chart, contact_pattern):
        figure = chart(stage)
        assert len(figure.axes) >= 2
        assert all("stage" in ax.get_title(loc="left") for ax in figure.axes[:2])


@pytest.mark.parametrize("share", [-1.0, 1e-3, 0.0, 3.0])
def test_any_torque_has_an_equilibrium(share):
    """Turned back the coast flanks carry; hardly loaded, single slices do; at rest none has to."""
    model = rigid_stage(BASE.with_(**{"stage.gear_mesh.model": "face_load"}))
    data = static(model, CYCLE[:3], share * model.system.rated_torque)
    assert data.closure.max() < 1e-8
    carries = data["pair_load"].sum(("position", "slot")).groupby("flank_sense").sum()
    sense = "coast" if share < 0 else "drive"
    if share:
        assert carries.sel(flank_sense=sense) > 0
        assert carries.sum() == pytest.approx(carries.sel(flank_sense=sense).item())


def test_slices_push_only():
    """Linear contact, which a stage of lumped members has where it does not say, is not theirs."""
    data = fg.load_case("lin-parker").stages[0].model_dump(exclude={"gear_mesh"})
    lumped = Stage.model_validate({**data, "gear_mesh": {"model": "face_load"}})
    assert lumped.gear_mesh.contact_law == "one-sided"
    with pytest.raises(InputError, match="allows tensile forces"):
        fg.load_case("lin-parker", {"stage.gear_mesh.model": "face_load"})


SLICED = load_case("wind-5mw").with_(
    **{"stage.gear_mesh.model": "face_load", "stage.gear_mesh.slices": 5}
)
TURN = 2 * np.pi / 93 * np.array([0.0, 0.4, 31.7])


def model(bends, **changes):
    case = SLICED.with_(**changes)
    if not bends:
        return rigid_stage(case)
    return assemble(case, bodies=cheap_stage(case.view()))


@pytest.fixture(scope="module", params=[True, False], ids=["flexible", "rigid"])
def data(request):
    return static(model(request.param), TURN)


def test_bodies_add_up_to_what_the_contact_lines_feel(data):
    """The one from coordinates of bodies, the other from the approach of both rows of pairs."""
    by_cause = data["gear_mesh_misalignment_by_cause"]
    assert list(by_cause["cause"]) == list(CAUSES)
    whole = data["gear_mesh_misalignment"]
    bodies = by_cause.sel(cause=list(CAUSES[:-2])).sum("cause", skipna=False)
    assert np.abs(whole).max() > 1e-5
    np.testing.assert_allclose(bodies, whole, atol=1e-8 * float(np.abs(whole).max()))


def test_soft_bearings_tilt_pinion_and_gear(tmp_path):
    """The difference of their displacements along the line of action, over their distance."""
    path = write(tmp_path, shaft_text().replace('"constant"', '"face_load"'))
    data = fg.load_case(path).assemble().static(angle_deg=[0.0])
    tilts = {}
    for part in ("pinion", "gear"):
        first, second = (
            data["bearing_force"].sel(support=f"stage_1.{part}_support_{k}").to_numpy()[0, :2]
            for k in (1, 2)
        )
        along = (first + second) / np.linalg.norm(first + second)
        per_length = (second / 3e8 - first / 8e8) @ along / (A[part] + B[part])
        beta_b = np.arcsin(np.sin(np.radians(HELIX)) * np.cos(np.radians(20)))
        tilts[part] = -1e6 * per_length * 0.05 / np.cos(beta_b)
    (figures,) = face_figures(data).values()
    assert figures["misalignment_by_cause_um"] == pytest.approx(tilts, rel=2e-3)


def test_the_planets_bearing_tilts_both_gear_meshes_of_a_planet(data):
    """One rotation of the planet on its pin, seen along both lines of action."""
    from_bearing = data["gear_mesh_misalignment_by_cause"].sel(cause="planet bearing")
    for kind in ("ring", "sun"):
        tilts = from_bearing.sel(flank=f"stage {kind} 3 drive").to_numpy()
        assert np.abs(tilts).max() > 1e-6
    other = data["gear_mesh_misalignment_by_cause"].sel(flank="stage ring 3 drive")
    assert not other.sel(cause=["sun", "gear", "errors", "modifications"]).to_numpy().any()


def test_misalignment_by_flanks_adds_to_that_by_bodies():
    """What is missing at the +z end lets the bodies come closer by itself, ground or by error."""
    changes = {
        "stage.planet.modifications.sun.helix_slope": 15e-6,
        "stage.errors.sun_helix_slope": 20e-6,
    }
    changes["stage.planet.modifications.sun.lead_crowning"] = 8e-6
    by_cause = static(model(False, **changes), TURN[:1])["gear_mesh_misalignment_by_cause"]
    flank = by_cause.sel(flank="stage sun 1 drive").isel(position=0)
    cos_b = np.cos(stage_geometry(SLICED.view()).base_helix_angle)
    assert flank.sel(cause="errors").item() == pytest.approx(-20e-6 * cos_b, rel=1e-9)
    # the places of slices are not quite even, so that crowning is not quite without slope
    assert flank.sel(cause="modifications").item() == pytest.approx(-15e-6 * cos_b, abs=0.1e-6)


def test_figures_and_picture(data):
    figures = face_figures(data)
    groups = misalignment_of_groups(figures)
    assert set(groups) == {"stage ring", "stage sun"}
    for group, causes in groups.items():
        misalignments = [
            f["misalignment_um"] for name, f in figures.items() if name.startswith(group)
        ]
        assert sum(causes.values()) == pytest.approx(max(misalignments, key=abs), abs=1e-3)
    figure = misalignment_chart(data)
    ticks = [t.get_text() for t in figure.axes[0].get_xticklabels()]
    assert ticks[0] == "ring"
    assert ticks[-1] == "all together"
