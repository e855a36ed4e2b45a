"""``flexgear rate``: what is printed, written and drawn, refused and resumed."""

import csv
import json
import re
import xml.etree.ElementTree as ET

import pytest
from report_pages import require_sound
from rexs_schema import require_valid
from trains import spur_pair

import flexgear as fg
from flexgear.results.dataset_file import load
from flexgear.results.report.wording import with_unit

FEW = ["--set", "rating.gear_mesh_cycles=1", "--set", "rating.positions_per_gear_mesh=2"]


pytestmark = pytest.mark.usefixtures("cache")


def test_screen_files_and_page(flexgear, tmp_path):
    out = tmp_path / "sheet"
    text = flexgear.out("rate", "nrel-5mw", *FEW, "--out", out, "-q")
    first = text.splitlines()
    assert first[0].startswith("nrel-5mw: 14 load bins")
    assert "weakest part first" in text and "Not assessed" in text
    assert "K_γ, load sharing of the planets (key k_gamma)" in text
    pair = text.split("stage 3 pinion, load factors")[1].split("\n\n")[0]
    assert "K_v, " in pair and "planets" not in pair
    assert "micropitting" in text and f"wrote {out}" in text
    files = {
        "rating.json",
        "rating.nc",
        "rating.csv",
        "report.html",
        "reserves.png",
        "damage.png",
        "duration.png",
    }
    assert files <= {path.name for path in out.iterdir()}
    require_sound(out / "report.html", "rating", "spectrum", "rating_gears", "bearings", "case")
    page = (out / "report.html").read_text().replace("\xa0", " ")
    assert page.count('<details class="folded">') == 6  # bearings of two stages, not the weakest
    assert "<summary>stage 1 planet bearings, one by one</summary>" in page
    summary = json.loads((out / "rating.json").read_text())
    assert summary["result"] == "rating" and summary["schema_version"] == 1
    weakest = summary["parts"][summary["weakest"][0]]
    reserves = [p["load_reserve"] for p in summary["parts"].values() if p.get("load_reserve")]
    assert weakest["load_reserve"] == min(reserves)
    data = load(out / "rating.nc")
    assert data["stress"].attrs["units"] == "Pa"
    with open(out / "rating.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    of_bin = {
        r["quantity"]
        for r in rows
        if (r["of"], r["bin"]) == ("stage_1.sun flank", "extreme torque")
    }
    assert {"stress", "bin_safety", "load_cycles", "Z_H", "σ_H"} <= of_bin
    of_required = {r["unit"] for r in rows if r["quantity"] == "required" and "bearing" in r["of"]}
    assert of_required == {"h"} and "no assessed part fails within" in text
    damage = dict[str, float]()
    for r in rows:
        if re.match(r"stage_3\.\w+ (flank|root)$", r["of"]) and r["quantity"] == "damage":
            damage[r["bin"]] = damage.get(r["bin"], 0.0) + float(r["value"])
    worst = max(damage, key=damage.__getitem__)
    assert f"stage 3 pinion, load factors in {worst}\n" in text and worst != "extreme torque"
    require_valid(out / "rating.rexs")
    model = ET.parse(out / "rating.rexs").getroot()
    pitting = {
        float(attribute.text)
        for attribute in model.find("load_spectrum").iter("attribute")
        if attribute.get("id") == "safety_factor_pitting_iso_6336_2019"
    }
    safeties = {
        float(r["value"]) for r in rows if r["quantity"] == "bin_safety" and "flank" in r["of"]
    }
    assert pitting == safeties and len(model.find("load_spectrum")) == 15
    names = {"dynamic_factor": "K_v", "face_load_factor_contact_stress": "K_Hβ"}
    for load_case in model.find("load_spectrum")[1:]:  # the first one is the rated state
        for name, symbol in names.items():
            attribute = f"{name}_iso_6336_2019"
            of_file = [a.text for a in load_case.iter("attribute") if a.get("id") == attribute]
            of_bin = [r["value"] for r in rows if r["bin"] == load_case.get("name")
                      and r["quantity"] == symbol and "flank" not in r["of"]]  # fmt: skip
            assert of_file and set(of_file) == set(of_bin), (load_case.get("name"), symbol)
    lives = {
        f"{float(attribute.text):.9g}"
        for attribute in model.find("load_spectrum").iter("attribute")
        if attribute.get("id") == "nominal_rating_life_rotations_iso_281_2007"
    }
    of_bearings = [r for r in rows if r["quantity"] == "L_10"]
    assert any("pinion_support_2" in r["of"] for r in of_bearings)
    assert lives == {f"{float(r['value']):.9g}" for r in of_bearings}  # 10⁶ revolutions
    # an earlier rating of the case gives way, that of another does not
    flexgear.out("rate", "nrel-5mw", *FEW, "--out", out, "-q", "--no-pictures")
    assert "holds a rating of nrel-5mw" in flexgear.refused("rate", "lin-parker", "--out", out)


def test_without_keys_of_rating(flexgear, tmp_path):
    """Nothing is assumed: what is missing is named, and the command is content."""
    summary = flexgear.json("rate", "pitch-drive", *FEW, "--out", tmp_path / "r", "--no-pictures")
    assert summary["parts"] and all("not_assessed" in p for p in summary["parts"].values())
    assert "K_Hβ is not known" in summary["not_assessed"]["stage_1 sun"]
    assert summary["reliability"] is None


def test_a_flank_may_carry_nothing_at_half_of_the_positions(flexgear, tmp_path):
    slices = 'stages.stage_1.gear_mesh={ model = "face_load", slices = 5 }'
    options = [*FEW, "--set", slices, "--out", tmp_path / "r", "--no-pictures"]
    summary = flexgear.json("rate", "pitch-drive", *options)
    assert 0.0 <= summary["load_factor_change_with_half_of_positions"] < 1.0


def test_comparing_two_designs_says_why_a_part_has_no_life(flexgear, tmp_path):
    flexgear.out("cases", "nrel-5mw", "--copy", tmp_path / "own.toml")
    text = (tmp_path / "own.toml").read_text()
    (tmp_path / "bare.toml").write_text(text.replace("dynamic_rating_kn = 2380 ", "# "))
    cases = [tmp_path / "own.toml", "--against", tmp_path / "bare.toml"]
    text = flexgear.out("compare", *cases, "--life", "-q")
    assert "load reserve 1" in text and "not assessed in own" not in text
    reasons = text.split("not assessed in bare\n")[1]
    assert "stages.stage_2.planet_bearing.dynamic_rating_kn is missing" in reasons


def test_the_first_line_counts_trains_with_deviations(flexgear):
    drawn = "rating.deviations=drawn", "rating.deviation_samples=2"
    error = "tolerance.errors.pin_tangential.standard_deviation_um=10"
    keys = [part for key in (*drawn, error) for part in ("--set", key)]
    text = flexgear.out("rate", "pitch-drive", *FEW, *keys, "-q")
    assert "; in each equilibria of 2 trains at " in text.splitlines()[0]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ('[[rating.gear_meshes]]\nstage = "stage_9"\nk_v = 1.1\n', "stage_9"),
        ("[rating]\nk_v = 0.5\n", "rating.k_v"),
        ('[[load_cases]]\nname = "x"\nhours = 1\ntorque_nm = -9\n', "against the rated sense"),
        ('[[load_cases]]\nname = "x"\nhours = 1\nspeed_rpm = 999999\n', "check value and unit"),
        ('[[load_cases]]\nname = "x"\ntorque_nm = 100\n', "hours"),
    ],
)
def test_bad_rating_sections_are_one_line(flexgear, tmp_path, more, message):
    flexgear.out("cases", "pitch-drive", "--copy", tmp_path / "own.toml")
    with open(tmp_path / "own.toml", "a", encoding="utf-8") as file:
        file.write(f"\n{more}")
    for command in ("rate", "check"):
        assert message in flexgear.refused(command, tmp_path / "own.toml", "--out", tmp_path / "r")
        assert not (tmp_path / "r").exists()


@pytest.mark.usefixtures("no_pixels")
def test_a_load_case_above_static_strength_is_drawn_and_named(flexgear, tmp_path):
    """Nothing bears it once: the part fails, whatever the other load cases do."""
    few = {"rating__gear_mesh_cycles": 1, "rating__positions_per_gear_mesh": 2}
    case = fg.load_case("nrel-5mw", **few)
    heavy = case.load_cases[0].model_copy(update={"name": "far too much", "torque": 6e7})
    case = case.with_(load_cases=(*case.load_cases, heavy))
    rating = case.rate(tmp_path / "sheet")
    broken = [part for part in rating.ranked if part.damage_sum == float("inf")]
    assert broken and {rating.bins[p.worst_bin].name for p in broken} == {"far too much"}
    assert (tmp_path / "sheet" / "damage.png").exists()
    assert (
        "above static strength in far too much" in (tmp_path / "sheet" / "report.html").read_text()
    )
    assert (tmp_path / "sheet" / "rating.json").exists()
    assert rating.ranked[0].reserve == min(p.reserve for p in rating.parts if not p.missing)
    assert f"{rating.ranked[0].least_safety:.2f}"[:3] in rating._repr_html_()
    assert set(rating.dataset()["part_kind"].to_numpy()) == {"flank", "root", "bearing"}
    with pytest.raises(fg.InputError, match="of the wrong type"):
        case.rate(workers="two")


@pytest.mark.parametrize(
    ("hours", "text"),
    [
        (23.44, "23.4 h"),
        (58312.0, "58 300 h (6.65 years)"),
        (358788.0, "359 000 h (40.9 years)"),
        (6358788.0, "over 1 000 000 h"),
        (float("inf"), "over 1 000 000 h"),
        (float("nan"), "–"),
    ],
)
def test_a_life_has_three_figures(hours, text):
    assert with_unit(hours, "h").replace("\u202f", " ") == text


def test_loads_without_duration_are_not_of_zero_hours(flexgear, tmp_path):
    path = tmp_path / "pair.toml"
    path.write_text(spur_pair())
    out = flexgear.out("rate", path, "--no-pictures", "--out", tmp_path / "rating")
    assert out.startswith("pair: 1 load bin; in each equilibria at ")
    assert "no duration" in out and " 0 h" not in out
