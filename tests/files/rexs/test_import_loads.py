"""Loads and load cases of REXS files: torque, speed and forces at ports, durations, their sense."""

import math
import re

import numpy as np
import pytest
from rexs_samples import MM, NM, RPM, planetary

from flexgear.gears.load_bins import bins_of_load_cases, case_in_bin
from flexgear.gears.power_flow import power_flow
from flexgear.model.errors import InputError
from flexgear.model.load import load_case

TURNS = 60 / (2 * math.pi)


@pytest.mark.parametrize("unit", ["lbf / in", "N m"])
def test_values_in_unknown_units_are_named(imported, spectrum, unit):
    """Such a value is as good as missing, which must be seen where the file is imported."""
    m = spectrum
    m.set(m.fixed, radial_stiffness=(4e9, unit))
    m.load_cases[4][m.drive] = {"rotational_speed": (6.0, "furlong")}
    assumed = imported(m)[1].assumed
    (line,) = (line for line in assumed if "radial_stiffness:" in line)
    assert line.startswith(f"coupling {m.fixed},") and unit in line
    assert any("rotational_speed, load case 4:" in line for line in assumed)


def test_load_cases(imported, spectrum):
    m = spectrum
    first, conversion = imported(m)
    assert first.inputs[0].torque == 2000 and first.inputs[0].speed * TURNS == pytest.approx(12)
    assert any("load case 9" in line and "--load-case 9" in line for line in conversion.left_out)
    assert any("that of the load case is used" in line for line in conversion.left_out)
    second, _ = imported(m, load_case_id=9)
    assert second.inputs[0].torque == 1000 and second.inputs[0].speed * TURNS == pytest.approx(6)
    with pytest.raises(InputError, match="there are: 4, 9"):
        imported(m, load_case_id=5)


def test_load_cases_with_durations(imported, spectrum):
    """Durations, or shares of the whole; the first one stays the rated state."""
    m = spectrum
    m.load_cases[4][m.unit] = {"operating_time": (70.0, "h")}
    m.load_cases[9][m.unit] = {"operating_time_fraction": (30.0, "%")}
    m.load_cases[12] = {m.load: {"torque_around_u_axis": (10.0, NM)}}
    case, conversion = imported(m)
    assert case.inputs[0].torque == 2000
    first, second = case.load_cases
    assert (first.hours, first.torque) == (70, 2000)
    assert (second.hours, second.torque) == (pytest.approx(6000), 1000)
    assert second.speed * TURNS == pytest.approx(6)
    assert any("of 20000 h in all, assumed" in line for line in conversion.assumed)
    assert any("load case 12" in line for line in conversion.left_out)
    assert "shares of time add up to 30 %" in conversion.assumed
    assert not any("load case 9 (" in line for line in conversion.left_out)
    assert not any("the rated one" in line for line in conversion.assumed)
    m.set(m.unit, operating_time=(1000.0, "h"))
    case, conversion = imported(m, load_case_id=9)
    assert case.load_cases[1].hours == pytest.approx(300)
    assert any("load case 4 has 2 times the torque" in line for line in conversion.assumed)


def test_load_factors_are_in_comments_and_k_a_is_a_key(imported, spectrum, tmp_path):
    """Out of the comments, the factors of each load case are those of the file, the largest of all
    planets; names are those of several versions of the format."""
    m = spectrum
    m.load_cases[4][m.unit] = m.load_cases[9][m.unit] = {"operating_time": (70.0, "h")}
    meshes = {name: number for number, (_, name, _) in m.components.items()}  # of the last planet
    sun, ring = meshes["sun mesh"], meshes["ring mesh"]
    for number in m.of("cylindrical_stage"):
        m.set(number, application_factor_iso_6336_2006=(1.1, "none"),
              mesh_load_factor_iso_6336_2019=(1.05, "none"))  # fmt: skip
        m.load_cases[4][number] = {"dynamic_factor_iso_6336_2019": (1.01, "none")}
        m.load_cases[9][number] = {"dynamic_factor_din_3990_1987": (1.02, "none"),
                                   "mesh_load_factor_iso_6336_2019": (1.05, "none")}  # fmt: skip
    m.set(ring, face_load_factor_flank=(1.3, "none"))
    m.load_cases[9][sun] |= {"application_factor_iso_6336_2006": (1.25, "none")}
    m.load_cases[9][sun] |= {"dynamic_factor_din_3990_1987": (1.04, "none")}
    case, conversion = imported(m)
    forced = [case_in_bin(case, b).rating.forced for b in bins_of_load_cases(case)]
    applied = [[f("low", kind).application_factor for kind in ("sun", "ring")] for f in forced]
    assert applied == [[1.1, 1.1], [1.25, 1.1]] and case.rating.application_factor == 1.25
    assert {f("low", kind).k_v for f in forced for kind in ("sun", "ring")} == {None}
    assert not any("_factor" in line for line in conversion.left_out if "of the model" not in line)
    assert any("in comments" in line for line in conversion.assumed)
    assert "k_v = 1.04  " in conversion.text and f'{sun} "sun mesh", dynamic' in conversion.text
    assert conversion.text.count("# k_gamma") == 2  # not again for load cases with the same
    path = tmp_path / "with.toml"
    keys = r"^# (?=\[\[\w+\.gear_meshes\]\]|(stage|kind|k_\w+) = )"
    path.write_text(re.sub(keys, "", conversion.text, flags=re.M), "utf-8")
    case = load_case(path)
    for load_bin, of_sun, of_ring in zip(
        bins_of_load_cases(case), (1.01, 1.04), (1.01, 1.02), strict=True
    ):
        rules = case_in_bin(case, load_bin).rating
        forced = [rules.forced("low", kind) for kind in ("sun", "ring")]
        assert [f.k_gamma for f in forced] == [1.05, 1.05]
        assert [f.k_h_beta for f in forced] == [None, 1.3]
        assert [f.k_v for f in forced] == [of_sun, of_ring]


@pytest.mark.parametrize(
    ("torque", "speed", "reversed_"),
    [(2000.0, 12.0, False), (-2000.0, 12.0, True), (2000.0, -12.0, True), (-2000.0, -12.0, False),
     (-2000.0, 0.0, True), (2000.0, 0.0, False), (0.0, 12.0, False)],
)  # fmt: skip
def test_back_driven_load_cases_run(imported, spectrum, torque, speed, reversed_):
    """A file states the sense of power by the signs of torque and speed; the load bins of a rating,
    which refuse power against the rated one, take the case as it is."""
    m = spectrum
    m.load_cases[4][m.unit] = {"operating_time": (70.0, "h")}
    m.load_cases[9] = {
        m.unit: {"operating_time": (30.0, "h")},
        m.load: {"torque_around_u_axis": (torque, NM)},
        m.drive: {"rotational_speed": (speed, RPM)},
    }
    case, _ = imported(m)
    assert [c.back_driven for c in case.load_cases] == [False, reversed_]
    second = bins_of_load_cases(case)[1]
    assert second.torque["low.carrier"] == pytest.approx(torque)


def test_load_and_speed_on_different_shafts(imported):
    """A speed that is given at the other end counts; a torque against its speed brakes."""
    m = planetary()
    m.set(m.drive, rotational_speed=None, defines_speed=None)
    m.set(m.sun_shaft, rotational_speed=(54.0, RPM), defines_speed=(True, "none"))
    case, _ = imported(m)
    flow = power_flow(case)
    assert flow.speed["low.carrier"] * TURNS == pytest.approx(12)
    assert case.output.member == "low.sun"
    m.set(m.load, torque_around_u_axis=(-3000.0, NM))
    assert imported(m)[0].output.member == "low.carrier"


def test_power_at_zero_speed_gives_no_torque(imported):
    m = planetary()
    m.set(m.drive, rotational_speed=(0.0, RPM))
    m.set(m.load, torque_around_u_axis=None, power=(100.0, "kW"))
    case, conversion = imported(m)
    assert case.output is None
    assert any("torques of the file do not suffice" in line for line in conversion.assumed)


def test_without_loads_it_is_a_case_of_free_vibration(imported):
    m = planetary()
    m.set(m.load, torque_around_u_axis=None)
    case, conversion = imported(m)
    assert case.output is None and any("free vibration" in line for line in conversion.assumed)


def test_forces_on_members(imported):
    """Forces along v, w, u are those along x, y, z; a load that has only forces is no port."""
    m = planetary()
    forces = {f"force_{a}_direction": (f, "N") for a, f in (("u", 10.0), ("v", 20.0), ("w", 30.0))}
    m.part(m.drive, "external_load", "weight", torque_around_w_axis=(5.0, NM), **forces)
    case, _ = imported(m)
    assert len(case.inputs) == 1
    (load,) = case.loads
    assert (load.member, load.force, load.moment) == ("low.carrier", (20, 30, 10), (0, 5, 0))


def test_force_at_a_distance_has_its_moment(imported):
    """r × F about the middle of the carrier, 250 mm behind the begin of its shaft, of a weight that
    acts 40 mm behind it."""
    m = planetary()
    m.part(m.drive, "external_load", "weight", u_coordinate_on_shaft=(40.0, MM),
           force_v_direction=(-9e4, "N"), force_w_direction=(2e4, "N"))  # fmt: skip
    load = imported(m)[0].loads[0]
    assert load.force == (-9e4, 2e4, 0)
    moment = np.cross([0, 0, 0.04 - 0.25], [-9e4, 2e4, 0])
    assert load.moment == pytest.approx(moment.tolist())
