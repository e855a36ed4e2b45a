"""The section [lubricant] of a case: units and contradictions."""

import pytest

from flexgear.model.errors import InputError
from flexgear.model.load import load_case

OIL = {"lubricant.viscosity_40_mm2_per_s": "320"}


def test_units_and_default():
    assert load_case("lin-parker").lubricant is None
    settings = OIL | {"lubricant.temperature_c": "65", "lubricant.viscosity_100_mm2_per_s": "24"}
    oil = load_case("lin-parker", settings).lubricant
    assert oil.viscosity_40 == pytest.approx(320e-6) and oil.temperature == pytest.approx(338.15)
    assert oil.viscosity_100 == pytest.approx(24e-6)


@pytest.mark.parametrize(
    ("settings", "line"),
    [
        ({"viscosity_100_mm2_per_s": "400"}, "viscosity decreases"),
        ({"temperature_c": "65", "operating_viscosity_mm2_per_s": "90"}, "beside temperature"),
        ({"cleanliness": "-/15/12", "contamination": "0.5"}, "beside cleanliness"),
        ({"temperature_c": "338"}, "338 °C is outside"),
        ({"cleanliness": "clean"}, "cleanliness"),
    ],
)
def test_contradictions_are_one_line(settings, line):
    with pytest.raises(InputError, match=line):
        load_case("lin-parker", OIL | {f"lubricant.{key}": v for key, v in settings.items()})


def test_viscosity_is_needed():
    with pytest.raises(InputError, match=r"viscosity_40.*missing"):
        load_case("lin-parker", {"lubricant.temperature_c": "65"})
