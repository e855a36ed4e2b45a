"""Files that are no REXS end in one line and exit code 2."""

import io
import zipfile

import pytest
from rexs_samples import planetary

from flexgear.files.rexs.reading import VERSIONS, read_rexs
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
    "truncated": (XML[: len(XML) // 2], "is the file whole"),
    "truncated json": (planetary().json()[:500], "is the file whole"),
    "other xml": (b"<html/>", "begins with <model>"),
    "other json": (b'{"a": 1}', "is missing"),
    "bomb": (BOMB, "DOCTYPE"),
    "outside": (OUTSIDE, "DOCTYPE"),
    "deep": (b"<model>" + b"<a>" * 10000 + b"</a>" * 10000 + b"</model>", "elements deep"),
    "deep and open": (b"<model>" + b"<a>" * 10000, "is the file whole"),
    "deep json": (b'{"model": ' + b"[" * 100000, "cannot be read"),
    "version": (planetary("3.1").xml(), ", ".join(VERSIONS)),
    "no version": (XML.replace(b'version="2.0"', b"", 1), "is not known"),
    "no components": (b'<model version="2.0"><components/></model>', "there are none"),
    "id": (XML.replace(b'component id="7"', b'component id="seven"'), "not a whole number"),
    "twice": (XML.replace(b'component id="7"', b'component id="8"'), "is there twice"),
    "encoding": (XML.replace(b"UTF-8", b"klingon"), "cannot be read"),
    "two models": (zipped(a_rexs=XML, b_rexs=XML), "holds 2 models"),
    "no model": (zipped(readme_txt="hello"), "holds 0 models"),
    "broken zip": (zipped(a_rexs=XML)[:-30], "damaged"),
    "json lists": (b'{"model": {"version": "2.0", "components": [1]}}', "list of objects"),
}


@pytest.mark.parametrize("what", BAD)
def test_bad_file(tmp_path, what):
    data, said = BAD[what]
    path = tmp_path / "bad.rexs"
    path.write_bytes(data)
    with pytest.raises(InputError) as caught:
        read_rexs(path)
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_missing_file_and_folder(tmp_path):
    for path in (tmp_path, tmp_path / "none.rexs", "a\0b"):
        with pytest.raises(InputError):
            read_rexs(path)
