"""Files that are no REXS, and gearboxes that cannot be, end in one line."""

import io
import tomllib
import zipfile

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rexs_samples import ARM, MM, planetary, three_stages

from flexgear.files.rexs.reading import VERSIONS, read_rexs
from flexgear.files.rexs.to_case import case_of_document
from flexgear.model.errors import InputError

BOMB = b"""<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]>
<model version="2.0"><components><component id="1" type="shaft" name="&b;"/></components></model>"""
OUTSIDE = (
    b"""<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]><model version="2.0">&a;</model>"""
)


def zipped(**files):
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        for name, content in files.items():
            archive.writestr(name.replace("_", "."), content)
    return data.getvalue()


XML = planetary().xml()
BAD = {
    "empty": (b"", "is empty"),
    "text": (b"gearbox", "neither XML, JSON nor zip"),
    "truncated": (XML[: len(XML) // 2], "is the file complete"),
    "truncated json": (planetary().json()[:500], "is the file complete"),
    "other xml": (b"<html/>", "begins with <model>"),
    "other json": (b'{"a": 1}', "is missing"),
    "bomb": (BOMB, "DOCTYPE"),
    "outside": (OUTSIDE, "DOCTYPE"),
    "deep": (b"<model>" + b"<a>" * 10000 + b"</a>" * 10000 + b"</model>", "is nested in"),
    "deep and open": (b"<model>" + b"<a>" * 10000, "is the file complete"),
    "deep json": (b'{"model": ' + b"[" * 100000, "cannot be read"),
    "version": (planetary("3.1").xml(), ", ".join(VERSIONS)),
    "no version": (XML.replace(b'version="2.0"', b"", 1), "is not known"),
    "no components": (b'<model version="2.0"><components/></model>', "there are none"),
    "id": (XML.replace(b'component id="7"', b'component id="seven"'), "not a whole number"),
    "twice": (XML.replace(b'component id="7"', b'component id="8"'), "occurs twice"),
    "encoding": (XML.replace(b"UTF-8", b"klingon"), "cannot be read"),
    "two models": (zipped(a_rexs=XML, b_rexs=XML), "holds 2 models"),
    "no model": (zipped(readme_txt="hello"), "holds 0 models"),
    "broken zip": (zipped(a_rexs=XML)[:-30], "damaged"),
    "json lists": (b'{"model": {"version": "2.0", "components": [1]}}', "list of objects"),
}


@pytest.mark.parametrize("what", BAD)
def test_a_bad_file_is_refused_in_one_line(tmp_path, what):
    data, message = BAD[what]
    path = tmp_path / "bad.rexs"
    path.write_bytes(data)
    with pytest.raises(InputError) as caught:
        read_rexs(path)
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_missing_file_and_folder(tmp_path):
    for path in (tmp_path, tmp_path / "none.rexs", "a\0b"):
        with pytest.raises(InputError):
            read_rexs(path)


def test_meshing_planets_are_said_not_to_fit(tmp_path):
    m = planetary()
    pair = m.part(m.stage, "cylindrical_stage")
    m.relate("stage", stage=pair, gear_1=m.planets[0], gear_2=m.planets[1])
    with pytest.raises(InputError, match="mesh with one another"):
        m.case(tmp_path)


WRONG = {
    "teeth": ("planet", {"number_of_teeth": (25.5, "")}, "25.5 is not a whole number"),
    "helix": ("planet", {"helix_angle_reference_diameter": (95.0, "deg")}, "no helix angle"),
    "hours": ("unit", {"operating_time": (-7.0, "h")}, "-7 is negative"),
    "word": ("unit", {"operating_time": ("long", "h")}, "is no duration"),
    "share": ("unit", {"operating_time_fraction": ("nan", "%")}, "is no duration"),
}


@pytest.mark.parametrize("what", WRONG)
def test_wrong_numbers_are_refused(tmp_path, what):
    """They would become other gears, or another spectrum: -7 h an extreme load."""
    where, attributes, message = WRONG[what]
    m = planetary()
    if where == "unit":
        m.load_cases = {1: {m.unit: attributes}}
    else:
        for planet in m.planets:
            m.set(planet, **attributes)
    with pytest.raises(InputError, match=message):
        m.case(tmp_path)


def test_a_rating_that_is_none_is_listed(imported):
    m = planetary()
    for bearing in m.planet_bearings:
        m.set(bearing, radial_dynamic_load_rating=(-900.0, "kN"))
    case, conversion = imported(m)
    assert case.stages[0].planet_bearing.dynamic_rating is None
    assert any("radial_dynamic_load_rating" in line for line in conversion.left_out)


def test_case_that_cannot_run_is_written_for_mending(tmp_path):
    m = planetary()
    for number in m.of("cylindrical_stage"):
        m.set(number, center_distance=(ARM + 12.0, MM))
    for transmits in (True, False):  # without loads, too
        for load in m.of("external_load"):
            m.set(load, transmits_torque=(transmits, "none"))
        path = m.write(tmp_path / "far.rexs")
        conversion = case_of_document(read_rexs(path), str(path))
        assert any("cannot run before this is corrected" in line for line in conversion.assumed)


SPOILT = ["0", "-1", "many", "1e30", "nan", "", ("1", "2"), None]


@pytest.fixture(scope="module")
def boxes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("boxes")
    return [make().write(folder / f"{make.__name__}.rexs") for make in (planetary, three_stages)]


@pytest.mark.slow
@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.integers(0, 1), st.randoms(use_true_random=False))
def test_whatever_is_missing_or_odd_is_said_in_one_line(boxes, box, random):
    """Files with parts taken out or spoilt become a case, or an error of one line."""
    document = read_rexs(boxes[box])
    for _ in range(random.randint(1, 6)):
        component = random.choice(list(document.components.values()))
        chance = random.random()
        if chance < 0.5 and component.attributes:
            name = random.choice(sorted(component.attributes))
            component.attributes[name].value = random.choice(SPOILT)
        elif chance < 0.75:
            document.relations.remove(random.choice(document.relations))
        else:
            del document.components[component.id]
            document.relations = [
                r for r in document.relations if component.id not in r.refs.values()
            ]
    message = "one line"
    try:
        tomllib.loads(case_of_document(document, "box.rexs").text)
    except InputError as fault:
        message = str(fault)
    assert "\n" not in message


def test_words_of_a_file_stay_in_their_comment(imported):
    m = planetary()
    word = ('ball"\nteeth = 7\r', "")
    m.set(m.planet_bearings[0], bearing_type=word, radial_dynamic_load_rating=(900.0, "kN"))
    assert imported(m, ".rexsj")[0].stages[0].planet_bearing.rolling == "ball"


@pytest.mark.parametrize("size", [1e100, 1e300])
def test_sizes_beyond_all_machines_are_left_out(imported, size):
    m = three_stages()
    m.set(m.section, outer_diameter_begin=(size, MM))
    assert any("outer_diameter_begin" in line for line in imported(m)[1].left_out)


def test_places_in_places_in_places(imported):
    m = planetary()
    place = {"support_vector": ((1.0, 0.0, 0.0), MM), "reference_component_for_position": (1, "")}
    last = m.add("shaft", **place)
    for _ in range(2000):
        last = m.add("shaft", **{**place, "reference_component_for_position": (last, "none")})
    m.set(m.drive, **{**place, "reference_component_for_position": (last, "none")})
    assert imported(m)[0].stages
