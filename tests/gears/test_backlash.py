"""Backlash of gear meshes where a case does not give it, and what errors close of it."""

import math

import numpy as np
import pytest
from gears.stages import UNLOADED, paths_of, planetary, seen

from flexgear.cli.case_commands import derived
from flexgear.gears.implausible import implausible
from flexgear.gears.power_flow import power_flow
from flexgear.gears.report import stage_report
from flexgear.model.load import case_of_toml
from flexgear.solve.model import assemble
from flexgear.solve.static import static

ONE_SIDED = {"contact_law": "one-sided"}


def plain_stage(**sections):
    """Four planets on soft pins, lumped, one-sided pairs; the backlash is left to the rule."""
    spring = {"radial_n_per_m": 3e8}
    stage = {
        "planets": 4, "normal_module_mm": 1.5, "pressure_angle_deg": 20, "face_width_mm": 20,
        "sun": {"teeth": 28}, "planet": {"teeth": 22}, "planet_bearing": spring,
        "ring": {"teeth": 72, "rim_thickness_mm": 9, "kinematics": "fixed"},
        "carrier": {"support": spring},
        "gear_mesh": {"model": "per_pair", "contact_law": "one-sided"}, **sections,
    }  # fmt: skip
    return case_of_toml({
        "title": "plain", "stage": stage, "output": {"member": "stage.sun"},
        "material": {
            "young_modulus_gpa": 206, "poisson_ratio": 0.3, "density_kg_per_m3": 7850},
        "inputs": [{"member": "stage.carrier", "speed_rpm": 1500, "torque_nm": 300}],
    }, "plain.toml", "plain")  # fmt: skip


@pytest.mark.parametrize(
    ("given", "expected_um"),
    # 2/3 (60 + 0.5 a + 30 m) µm by hand, a and m in mm: 270 and 10; 37.5 and 1.5 in the next test
    [({}, 330.0), ({"backlash_ring": 0.0}, 0.0), ({"backlash_ring": 4e-4}, 400.0)],
)  # fmt: skip
def test_backlash_is_that_of_the_case_or_of_the_rule(given, expected_um):
    for law, expected in (("one-sided", expected_um), ("linear", expected_um if given else 0.0)):
        path = paths_of(planetary(gear_mesh={"contact_law": law}, **given))["ring_coast", ""]
        assert 1e6 * path.backlash == pytest.approx(expected, abs=1e-9)


def test_check_names_the_rule():
    rows = derived(plain_stage())["ring_gear_mesh"]
    assert rows["backlash_um"] == pytest.approx(82.5)
    assert "ISO/TR 10064-2" in rows["backlash_by"]
    assert "case" in derived(plain_stage(backlash_ring_mm=0.1))["ring_gear_mesh"]["backlash_by"]
    linear = {"model": "per_pair", "contact_law": "linear"}
    assert "linear" in derived(plain_stage(gear_mesh=linear))["sun_gear_mesh"]["backlash_by"]


def test_coast_flanks_carry_nothing_by_default():
    """Load sharing with an error is that of gears far from touching behind; without backlash,
    flanks behind hold what the error moves, and it is another."""

    def loads(**keys):
        errors = {"pin_tangential_um": [20, 0, 0, 0], "carrier_eccentricity_um": 10}
        data = static(assemble(plain_stage(errors=errors, **keys)), np.linspace(0, 0.1, 7))
        coast = data.pair_load.sel(flank=data.flank_sense == "coast")
        return data.planet_load_factor.to_numpy(), float(np.abs(coast).max())

    by_rule, behind = loads()
    free, _ = loads(backlash_ring_mm=1.0, backlash_sun_mm=1.0)
    tight, held = loads(backlash_ring_mm=0.0, backlash_sun_mm=0.0)
    assert behind == 0.0 and by_rule == pytest.approx(free, rel=1e-9)
    assert held > 100.0 and tight.max() > free.max() * 1.05


def test_coast_tooth_numbers_follow_the_rule():
    """As if the same backlash had been given."""
    by_rule = paths_of(planetary(gear_mesh=ONE_SIDED))
    given = paths_of(planetary(gear_mesh=ONE_SIDED, backlash_ring=3.3e-4, backlash_sun=3.3e-4))
    for kind, path in by_rule.items():
        assert path.s0 == pytest.approx(given[kind].s0, abs=1e-15)


def closing(**errors):
    stage = planetary(gear_mesh=ONE_SIDED, errors=errors)
    report = stage_report(seen(stage), UNLOADED)
    return {name: report[f"{name}_gear_mesh"]["errors_close_up_to_um"] for name in ("sun", "ring")}


def test_what_errors_close_in_closed_form():
    """Thicker teeth by Δs cos α, an eccentric sun by 2 E sin α; what turns a planet by nothing."""
    a = math.radians(20)
    assert closing(planet_thickness=(40e-6,))["ring"] == pytest.approx(40 * math.cos(a))
    found = closing(sun_eccentricity=50e-6)
    assert found["sun"] == pytest.approx(100 * math.sin(a)) and found["ring"] == 0.0
    assert closing(pin_tangential=(50e-6, 0.0, 0.0))["sun"] == pytest.approx(0.0, abs=1e-12)
    assert closing(pin_radial=(50e-6, 0.0, 0.0))["ring"] == pytest.approx(100 * math.sin(a))


def test_check_warns_where_errors_close_the_backlash():

    def lines(eccentricity):
        case = plain_stage(errors={"sun_eccentricity_um": eccentricity})
        return [x for x in implausible(case, power_flow(case)) if "backlash" in x]

    (line,) = lines(130)
    assert "close up to 88.93 µm of a backlash of 82.5 µm in the sun gear mesh" in line
    assert not lines(110)
