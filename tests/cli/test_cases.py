"""check and cases."""

import json

import pytest

from flexgear.model.bundled import bundled_text


def test_check_prints_what_follows_from_the_case(flexgear):
    code, out, err = flexgear("check", "wind-5mw")
    assert code == 0
    assert err == ""
    for words in ("assembles", "planet_clearance_mm", "contact_ratio", "sun_speed_rpm", "phase"):
        assert words in out


def test_check_as_json_follows_willis(flexgear):
    code, out, _ = flexgear("check", "wind-5mw", "--json", "--set", "drive.rated_speed_rpm=10")
    found = json.loads(out)
    assert code == 0
    assert found["kinematics"]["sun_speed_rpm"] == pytest.approx(10 * (1 + 93 / 27))
    assert found["kinematics"]["gear_mesh_frequency_hz"] == pytest.approx(93 / 6)
    assert found["assembly"]["(z_sun + z_ring)/N"] == 24
    assert found["ring"]["reference_diameter_mm"] == pytest.approx(1688.44, abs=0.01)
    # planet 2 is 93/5 ring teeth on: the fraction is its phase, falling along the path
    assert found["ring_gear_mesh"]["phase_of_planets_in_pitches"][1] == pytest.approx(0.4)


def test_cases_lists_prints_and_copies(flexgear, tmp_path):
    assert "wind-5mw" in flexgear("cases")[1]
    assert flexgear("cases", "wind-5mw")[1] == bundled_text("wind-5mw")
    copy = tmp_path / "mine.toml"
    assert flexgear("cases", "wind-5mw", "--copy", copy)[0] == 0
    assert copy.read_text() == bundled_text("wind-5mw")
    code, _, err = flexgear("cases", "wind-5mw", "--copy", copy)
    assert code == 2
    assert "is there already" in err
    assert flexgear("check", copy)[0] == 0


def test_version(flexgear):
    code, out, _ = flexgear("--version")
    assert code == 0
    assert out.startswith("flexgear ")
