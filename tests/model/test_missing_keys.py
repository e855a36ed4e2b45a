"""A key without which the machine is another has no default; what is missing is named at once."""

import re

import pytest

from flexgear.model.errors import InputError
from flexgear.model.load import bundled_text, load_case


def without(folder, name, *keys):
    """A bundled case as a file in which the first line of each of these keys is left out."""
    text = bundled_text(name)
    for key in keys:
        text, count = re.subn(rf"(?m)^{key} = .*\n", "", text, count=1)
        assert count == 1, key
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("name", "key", "said"),
    [
        ("lin-parker", "planets", "stage.planets"),
        ("wind-5mw", "planets", "stage.planets"),
        ("wind-5mw", "planet_hand", "stage.planet_hand"),
        ("wind-5mw", "drive_side", "stage.carrier.fe.drive_side"),
        ("wind-5mw", "web_clearance_mm", "stage.carrier.fe.web_clearance_mm"),
        ("wind-5mw", "direction", "stage.sun.shaft.direction"),
        ("wind-5mw", "end", "stage.ring.fe.end"),
        ("nrel-5mw", "planet_hand", r"stages\[2\].planet_hand"),
        ("nrel-5mw", "rolling", r"stages\[0\].planet_bearing.rolling"),
    ],
)
def test_the_machine_is_not_guessed(tmp_path, name, key, said):
    path = without(tmp_path, name, key)
    with pytest.raises(InputError, match=rf"mine.toml: {said}: is missing.* -- add "):
        load_case(path)


def test_spur_gears_need_no_hand(tmp_path):
    path = without(tmp_path, "wind-5mw", "planet_hand", "helix_angle_deg")
    assert load_case(path).stages[0].helix_angle == 0.0
    with pytest.raises(InputError, match=r"stage.planet_hand: is missing with a helix angle"):
        load_case(path, {"stage.helix_angle_deg": "7.5"})


def test_all_missing_keys_of_a_stage_are_named_at_once(tmp_path):
    keys = (
        "young_modulus_gpa", "planets", "planet_hand", "end", "pin_diameter_mm",
    )  # fmt: skip
    path = without(tmp_path, "wind-5mw", *keys)
    with pytest.raises(InputError) as caught:
        load_case(path)
    assert set(caught.value.key.split(", ")) == {
        "material.young_modulus_gpa", "stage.planets", "stage.planet_hand", "stage.ring.fe.end",
        "stage.carrier.fe.pin_diameter_mm",
    }  # fmt: skip
    assert "\n" not in str(caught.value)


def test_all_missing_keys_of_a_train_are_named_at_once(tmp_path):
    keys = ("planets", "normal_module_mm", "density_kg_per_m3")
    path = without(tmp_path, "lin-parker", *keys)
    with pytest.raises(InputError) as caught:
        load_case(path)
    assert set(caught.value.key.split(", ")) == {
        "material.density_kg_per_m3", "stage.planets", "stage.normal_module_mm",
    }  # fmt: skip


def test_missing_parts_and_sections_are_named_with_the_keys(tmp_path):
    path = tmp_path / "bare.toml"
    path.write_text('[[stages]]\n[[stages]]\nkind = "parallel"\n')
    with pytest.raises(InputError) as caught:
        load_case(path)
    named = set(caught.value.key.split(", "))
    assert {"material", "stages[0].planets", "stages[0].sun", "stages[0].carrier"} <= named
    assert {"stages[1].pinion", "stages[1].gear", "stages[1].face_width_mm"} <= named
    assert "stages[1].planets" not in named
