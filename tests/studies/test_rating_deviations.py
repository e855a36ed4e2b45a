"""Ratings with manufacturing deviations: grades by hand, worst of signs, drawn samples."""

import math
import re

import numpy as np
import pytest
from gears.rated_gears import PAIR, case_of, pair_of

from flexgear.gears.rating.load_factors import tolerance
from flexgear.model.errors import InputError
from flexgear.model.gear_mesh import GearErrors
from flexgear.model.load import load_case
from flexgear.model.load_cases import LoadCase
from flexgear.solve.bin_loads import BinLoads
from flexgear.studies.rating import deviated_cases, finished, rate, worst_of

KEYS = {
    **{f"stage.{b}.flexible": "false" for b in ("ring.fe", "carrier.fe", "sun.shaft")},
    **{f"stage.{g}.rating.accuracy_grade": "6" for g in ("sun", "planet", "ring")},
    "stage.gear_mesh.model": "face_load",
    "stage.gear_mesh.slices": "7",
    "rating.gear_mesh_cycles": "1",
    "rating.positions_per_gear_mesh": "4",
    "rating.k_v": "1.05",
}
STATES = (LoadCase(name="a", hours=1.0, torque=4e6),)


pytestmark = pytest.mark.usefixtures("cache")


def train(**changes):
    case = load_case("wind-5mw", KEYS)
    return case.with_(**{"load_cases": STATES, "stage.errors": GearErrors(), **changes})


def factors(case):
    """Load factors by group, in the only bin."""
    return {g.name: g.factors[0] for g in rate(case, workers=1).gear_meshes}


@pytest.mark.parametrize(
    ("edition", "of", "rounded"),  # µm of the pinion, grade 6, and of the gear, grade 7
    [
        (2006, "pitch", (9.0, 16.0)),  # 9.110, 15.53
        (2006, "profile", (10.0, 18.0)),  # 10.41, 18.47
        (2006, "helix", (10.0, 16.0)),  # 9.909, 15.55
        (2019, "pitch", (10.0, 15.0)),  # 10.05, 14.68
        (2019, "profile", (11.0, 16.0)),  # 10.96, 15.50
        (2019, "helix", (9.5, 15.0)),  # 9.705, 14.54
    ],
)
def test_deviations_of_grades_by_hand(tmp_path, edition, of, rounded):
    """21 and 67 teeth of module 5 at 8°: d = 106.03 and 338.29 mm; 45 mm wide. 1995: m = √(3.5·6) =
    4.583, d = √(50·125) = 79.06 and √(280·560) = 395.98, b = √(40·80) = 56.57 mm, in f_pt = 0.3
    (m + 0.4 √d) + 4, f_fα = 2.5 √m + 0.17 √d + 0.5, f_Hβ = 0.07 √d + 0.45 √b + 3; 2013 with sizes
    themselves: 0.001 d + 0.4 m + 5, 0.55 m + 5, 0.05 √d + 0.35 √b + 4; times √2 and 2."""
    pair, _ = pair_of(case_of(tmp_path, PAIR, **{"rating.edition": edition}))
    computed = [1e6 * tolerance(pair, gear, of) for gear in pair.gears.values()]
    assert computed == pytest.approx(rounded, rel=1e-9)
    stated = case_of(tmp_path, PAIR, **{"stages.pair.pinion.rating.helix_deviation": 3e-6})
    pair, _ = pair_of(stated)
    assert tolerance(pair, pair.pinion, "helix") == 3e-6


def test_the_worst_case_is_the_worst_of_its_signs_and_of_none():
    """Each deviated train by its errors alone; f_ma is the root of the sum of both squares."""
    case = train(**{"rating.deviations": "worst"})
    trains = deviated_cases(case)
    # √2 (0.05 √d + 0.35 √430 + 4) = 17.49 of 27 teeth and 17.65 of 33 of module 18 at 7.5°
    sun, planet = 17.0, 18.0
    slopes = {x.stages[0].errors.planet_sun_helix_slope for x in trains[1:]}
    f_ma = 1e-6 * math.hypot(sun, planet)
    assert {round(s[0] / f_ma, 9) for s in slopes} == {1.0, -1.0}
    alone = []
    for each in trains:
        errors = {"rating.deviations": "stated", "stage.errors": each.stages[0].errors}
        alone.append(factors(case.with_(**errors)))
    for name, worst in factors(case).items():
        of_all = [of_train[name]["K_Hβ"].value for of_train in alone]
        # K_γ is 1 in all of them but for rounding, so that K_Hβ decides
        assert worst["K_γ"].value == pytest.approx(1.0, abs=2e-3)
        assert worst["K_Hβ"].value == pytest.approx(max(of_all), rel=2e-3)
        assert max(of_all) > of_all[0] + 0.01
        assert "deviations" in worst["K_Hβ"].source
    sheet = factors(case)["stage sun"]
    (number,) = re.findall(r"deviations (\d)", sheet["K_Hβ"].source)
    (slope, *_) = trains[int(number)].stages[0].errors.planet_sun_helix_slope
    assert sheet["f_ma"].value == pytest.approx(1e6 * slope, rel=1e-9)
    assert abs(sheet["f_ma"].value) == pytest.approx(1e6 * f_ma, rel=1e-9)
    with pytest.raises(InputError, match="no stage has load along the face"):
        deviated_cases(case.with_(**{"stage.gear_mesh.model": "per_pair"}))


def test_drawn_deviations_are_those_of_tolerance():
    changes = {"rating.deviations": "drawn", "rating.deviation_samples": 2}
    errors = {"sun_helix_slope": {"standard_deviation": 1e-5}}
    case = train(**changes, **{"tolerance.errors": errors})
    trains = deviated_cases(case)
    slopes = [x.stages[0].errors.sun_helix_slope for x in trains]
    assert len(trains) == 2 and len(set(slopes)) == 2 and 0.0 not in slopes
    assert slopes == [x.stages[0].errors.sun_helix_slope for x in deviated_cases(case)]
    source = factors(case)["stage sun"]["K_Hβ"].source
    assert re.search(r"deviations [12]$", source)  # the first of the samples, too, is named
    assert finished(case) == 0  # the end forgets the bins of all of them


@pytest.mark.parametrize("noise", [1e-12, -1e-12])
def test_of_trains_with_like_forces_bearings_take_the_one_with_the_largest_moment(noise):
    """Not the one whose force is larger by rounding."""
    tilted, straight = (
        BinLoads({}, {"a.planet_bearing_1": np.array([[force, 0.0, 0.0, 0.0, moment, 0.0]])},
                 {"a": np.zeros(1)}, 0.0)
        for force, moment in ((5e4 * (1 + noise), 900.0), (5e4, 300.0))
    )  # fmt: skip
    for trains in ((tilted, straight), (straight, tilted)):
        assert worst_of(trains).supports["a.planet_bearing_1"][0, 4] == 900.0


def test_a_grade_that_is_missing_is_one_line():
    case = load_case("wind-5mw", {**KEYS, "rating.deviations": "worst"})
    bare = case.with_(**{"stage.sun.rating.accuracy_grade": None})
    with pytest.raises(InputError, match=r"sun.rating.accuracy_grade: is missing .*stated"):
        deviated_cases(bare)
