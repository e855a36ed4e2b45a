"""What misaligns a gear mesh adds up to what its contact lines feel."""

import numpy as np
import pytest
from stage_samples import cheap_stage
from train_contexts import rigid_stage

from flexgear.analysis.line_loads import CAUSES, OF_BODIES
from flexgear.gears.geometry import stage_geometry
from flexgear.model.load import load_case
from flexgear.results.face_load import face_figures, misalignment_of_groups
from flexgear.solve.model import assemble
from flexgear.solve.static import static
from flexgear.views.face_load_charts import misalignment_chart

BASE = load_case("wind-5mw").with_(
    **{"stage.gear_mesh.model": "face_load", "stage.gear_mesh.slices": 5}
)
TURN = 2 * np.pi / 93 * np.array([0.0, 0.4, 31.7])


def model(bends, **changes):
    case = BASE.with_(**changes)
    if not bends:
        return rigid_stage(case)
    return assemble(case, bodies=cheap_stage(case.view()))


@pytest.fixture(scope="module", params=[True, False], ids=["flexible", "rigid"])
def data(request):
    return static(model(request.param), TURN)


def test_bodies_add_up_to_what_the_contact_lines_feel(data):
    """The one from coordinates of bodies, the other from the approach of both rows of pairs."""
    found = data["gear_mesh_misalignment_by_cause"]
    assert list(found["cause"]) == list(CAUSES)
    whole = data["gear_mesh_misalignment"]
    bodies = found.sel(cause=list(OF_BODIES)).sum("cause", skipna=False)
    assert np.abs(whole).max() > 1e-5
    np.testing.assert_allclose(bodies, whole, atol=1e-8 * float(np.abs(whole).max()))


def test_the_planets_bearing_tilts_both_gear_meshes_of_a_planet(data):
    """One rotation of the planet on its pin, seen along both lines of action."""
    from_bearing = data["gear_mesh_misalignment_by_cause"].sel(cause="planet bearing")
    for kind in ("ring", "sun"):
        own = from_bearing.sel(flank=f"stage {kind} 3 drive").to_numpy()
        assert np.abs(own).max() > 1e-6
    other = data["gear_mesh_misalignment_by_cause"].sel(flank="stage ring 3 drive")
    assert not other.sel(cause=["sun", "gear", "errors", "modifications"]).to_numpy().any()


def test_flanks_come_on_top():
    """What is missing at the +z end lets the bodies come closer by itself, ground or by error."""
    changes = {
        "stage.planet.modifications.sun.helix_slope": 15e-6,
        "stage.errors.sun_helix_slope": 20e-6,
    }
    changes["stage.planet.modifications.sun.lead_crowning"] = 8e-6
    found = static(model(False, **changes), TURN[:1])["gear_mesh_misalignment_by_cause"]
    own = found.sel(flank="stage sun 1 drive").isel(position=0)
    cos_b = np.cos(stage_geometry(BASE.view()).base_helix_angle)
    assert own.sel(cause="errors").item() == pytest.approx(-20e-6 * cos_b, rel=1e-9)
    # the places of slices are not quite even, so that crowning is not quite without slope
    assert own.sel(cause="modifications").item() == pytest.approx(-15e-6 * cos_b, abs=0.1e-6)


def test_figures_and_picture(data):
    figures = face_figures(data)
    groups = misalignment_of_groups(figures)
    assert set(groups) == {"stage ring", "stage sun"}
    for group, causes in groups.items():
        own = [f["misalignment_um"] for name, f in figures.items() if name.startswith(group)]
        assert sum(causes.values()) == pytest.approx(max(own, key=abs), abs=1e-3)
    figure = misalignment_chart(data)
    ticks = [t.get_text() for t in figure.axes[0].get_xticklabels()]
    assert ticks[0] == "ring"
    assert ticks[-1] == "all together"
