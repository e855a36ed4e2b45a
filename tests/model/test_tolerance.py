"""The section ``tolerance``: what can be drawn, and what a user can get wrong in it."""

import math

import pytest
from small_train import SMALL

from flexgear.model.errors import InputError
from flexgear.model.load import bundled_text, load_case

PIN = "tolerance.errors.pin_radial"


def test_distributions_take_units_in_their_keys():
    case = load_case(
        "wind-5mw",
        {f"{PIN}.standard_deviation_um": "20", f"{PIN}.high_mm": "0.05",
         "tolerance.errors.sun_phase.high_deg": "90"},
    )  # fmt: skip
    drawn = case.tolerance.errors.given
    assert drawn["pin_radial"].standard_deviation == 20e-6
    assert drawn["pin_radial"].high == 5e-5
    assert drawn["sun_phase"].high == math.pi / 2


def test_a_tolerance_changes_no_run():
    """Results of a case do not depend on what a tolerance study would draw."""
    other = {"tolerance.seed": "7", f"{PIN}.standard_deviation_um": "20"}
    for name in ("wind-5mw", "pitch-drive"):
        assert load_case(name, other).content_hash() == load_case(name).content_hash()


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({f"{PIN}.high_um": "20"}, "standard_deviation_um: is missing in a normal distribution"),
        ({f"{PIN}.standard_deviation_mm": "1"}, "lets errors reach 8 mm"),
        ({f"{PIN}.standard_deviation_um": "1", f"{PIN}.low_um": "50"}, "low_um: excludes"),
        ({f"{PIN}.distribution": "uniform", f"{PIN}.low_um": "2", f"{PIN}.high_um": "2"},
         "high_um: is not above the low end"),
        ({f"{PIN}.distribution": "uniform", f"{PIN}.mean_um": "2"}, "low_um: is missing"),
        ({f"{PIN}.distribution": "rayleigh", f"{PIN}.standard_deviation_um": "2",
          f"{PIN}.mean_um": "2"}, "mean_um: has no meaning"),
        ({"tolerance.errors.ring_tooth.standard_deviation_um": "2"}, "size cannot be negative"),
        ({"tolerance.errors.sun_phase.low_deg": "400"}, "is not above the low end"),
        ({"tolerance.errors.ring_pitc.low_um": "3"}, "did you mean ring_pitch"),
        ({"tolerance.modifications.sun.lead_crowning.standard_deviation_um": "3"},
         'set gear_mesh.model = "face_load"'),
        ({"tolerance.modifications.sun.tip_relief.distribution": "uniform",
          "tolerance.modifications.sun.tip_relief.low_um": "3",
          "tolerance.modifications.sun.tip_relief.high_um": "4",
          "stage.gear_mesh.model": "face_load"},
         "has no tip relief in sun.modifications whose amount could be drawn"),
        ({"tolerance.modifications.sun.tip_relief.standard_deviation_um": "3"},
         "tip_relief.low_um: is not 0 or more"),
    ],
)  # fmt: skip
def test_distributions_that_do_not_fit_are_refused(settings, words, tmp_path):
    """In the bundled stage without its own distributions."""
    before, _, rest = bundled_text("wind-5mw").partition("[tolerance]")
    path = tmp_path / "stage.toml"
    path.write_text(before + "[solver]" + rest.partition("[solver]")[2], encoding="utf-8")
    with pytest.raises(InputError, match=words) as caught:
        load_case(path, settings)
    assert "\n" not in str(caught.value)


class TestTrain:
    @pytest.fixture
    def path(self, tmp_path):
        path = tmp_path / "train.toml"

        def write(text):
            path.write_text(SMALL + text, encoding="utf-8")
            return path

        return write

    def test_one_stage_has_its_own(self, path):
        train = load_case(path("""
[tolerance.errors]
planet_thickness = { standard_deviation_um = 3 }
sun_eccentricity = { distribution = "rayleigh", standard_deviation_um = 5 }
[[tolerance.by_stage]]
stage = "stage_2"
errors = { planet_thickness = { standard_deviation_um = 4 } }
"""))  # fmt: skip
        first, second = (train.tolerance.of(name) for name in ("stage_1", "stage_2"))
        assert first["planet_thickness"].standard_deviation == 3e-6
        assert second["planet_thickness"].standard_deviation == 4e-6
        assert second["sun_eccentricity"] == first["sun_eccentricity"]

    @pytest.mark.parametrize(
        ("stage", "key", "words"),
        [
            ("stage_3", "sun_tooth", r"by_stage\[0\].stage: no stage is 'stage_3'"),
            ("stage_2", "ring_offset", r"errors.ring_offset: is an error of a part that a par"),
        ],
    )
    def test_distributions_that_do_not_fit_are_refused(self, path, stage, key, words):
        text = f"""
[[tolerance.by_stage]]
stage = "{stage}"
errors.{key} = {{ distribution = "rayleigh", standard_deviation_um = 5 }}
"""
        with pytest.raises(InputError, match=words):
            load_case(path(text))

    def test_a_stage_that_is_named_twice_is_refused(self, path):
        one = '[[tolerance.by_stage]]\nstage = "stage_1"\nerrors = {}\n'
        with pytest.raises(InputError, match="stage_1 is named twice"):
            load_case(path(one + one))
