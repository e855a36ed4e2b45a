"""Contact pattern tooth by tooth: every load is on the teeth that carry it, at its diameter."""

import numpy as np
import pytest
from train_contexts import rigid_stage

from flexgear.gears.geometry import stage_geometry
from flexgear.model.load import load_case
from flexgear.model.names import GroupName
from flexgear.results.tooth_pattern import gear_pattern, loaded_flanks, planet_pattern
from flexgear.solve.static import static
from flexgear.views.face_load_charts import tooth_rows_chart

CASE = load_case("wind-5mw").with_(
    **{"stage.gear_mesh.model": "face_load", "stage.gear_mesh.slices": 5}
)
TURN = np.linspace(0, 2 * np.pi, 40, endpoint=False)


@pytest.fixture(scope="module")
def data():
    return static(rigid_stage(CASE), TURN)


def test_every_tooth_shows_its_largest_line_load(data):
    assert list(loaded_flanks(data)) == ["stage ring", "stage sun"]
    for kind, teeth in (("ring", 93), ("sun", 27)):
        gear = data.isel(flank=data["flank_kind"].to_numpy() == kind)
        load, tooth = gear["line_load"].max("slice").to_numpy(), gear["pair_tooth"].to_numpy()
        pattern = gear_pattern(data, GroupName.of("stage", kind))
        assert len(pattern.line_load) == teeth
        for number in (1, 7, teeth):
            largest = np.nanmax(load[tooth == number])
            assert np.nanmax(pattern.line_load[number - 1]) == pytest.approx(largest)


def test_diameters_lie_between_form_and_tip(data):
    """On involutes ends of the path are where one of both gears has its tip."""
    g = stage_geometry(CASE.view())
    for kind, gear in (("ring", g.ring), ("sun", g.sun)):
        planet = planet_pattern(data, GroupName.of("stage", kind))
        other = gear_pattern(data, GroupName.of("stage", kind))
        assert planet.diameter[-1] == pytest.approx(2 * g.planet.tip_radius, rel=1e-3)
        tip = 0 if kind == "ring" else -1
        assert other.diameter[tip] == pytest.approx(2 * gear.tip_radius, rel=1e-3)


def test_a_tooth_of_the_planet_meets_the_ring_in_steps_of_its_teeth(data):
    """Ring tooth and planet tooth of a pair advance together: their difference counts turns."""
    flank = data.sel(flank="stage ring 2 drive")
    ring, planet = flank["pair_tooth"].to_numpy(), flank["pair_planet_tooth"].to_numpy()
    contact = ring > 0
    assert np.array_equal(contact, planet > 0)
    teeth = CASE.stages[0].planet.teeth
    for t in range(3):
        at = np.argsort(flank["pair_position"].to_numpy()[t][contact[t]])
        steps = np.diff(ring[t][contact[t]][at]) % 93, np.diff(planet[t][contact[t]][at]) % teeth
        assert len(set(steps[0])) == len(set(steps[1])) == 1
        assert {int(steps[0][0]), int(steps[1][0])} <= {1, 92, teeth - 1}


def test_the_pattern_of_a_planet_is_drawn(data):
    figure = tooth_rows_chart(planet_pattern(data, GroupName.of("stage", "sun")))
    assert "33 teeth" in figure.axes[0].get_title(loc="left")
    assert figure.axes[0].get_ylabel() == "diameter (mm)"
