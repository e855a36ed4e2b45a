"""Files and figures that no program should write: one line, exit code 2, and never a wait."""

import gzip
import io
import json
import os
import pickle
import zipfile

import numpy as np
import pytest
from rexs_samples import planetary

import flexgear as fg
from flexgear.files.matrices.exchange import read_reduced
from flexgear.files.rexs.reading import read_rexs
from flexgear.files.rexs.to_case import case_of_document
from flexgear.model.errors import FlexgearError, InputError
from flexgear.results.dataset_file import load
from flexgear.results.run_folder import complete, read_folder
from flexgear.structures import store

TABLE = "id,name,x_m,y_m,z_m\n1,a,0,0,0\n2,b,0,0,1\n"
K = np.eye(12)


def npz(**arrays):
    out = io.BytesIO()
    np.savez_compressed(out, **arrays)
    return out.getvalue()


def op4(rows):
    return f"{rows:8d}{rows:8d}{2:8d}{2:8d}{'KRED':8s}1P,3E23.16\n".encode()


GOOD = npz(K=K, M=K)
MATRICES = {  # content of a file of matrices, and what the line says
    "damaged npz": (GOOD[:200] + bytes(40) + GOOD[240:], "npz: cannot be read"),
    "npz cut short": (GOOD[: len(GOOD) // 2], "npz: cannot be read"),
    "3-D": (npz(K=np.zeros((2, 3, 4)), M=K), "K: is 2 x 3 x 4, not a matrix"),
    "0-D": (npz(K=np.float64(3), M=K), "K: is a single number"),
    "empty": (npz(K=np.zeros((0, 0)), M=K), "K: is 0 x 0"),
    "structured": (npz(K=np.zeros((12, 12), [("a", float)]), M=K), "write real numbers"),
    "complex": (npz(K=1j * K, M=K), "K: holds complex128"),
    "objects": (npz(K=np.full((12, 12), {}), M=K), "K: holds object"),
    "not finite": (npz(K=np.nan * K, M=K), "K: has entries that are not finite"),
    "random bytes": (np.random.default_rng(0).bytes(4000), "cannot be read"),
    "gzip": (gzip.compress(b"hello" * 500), "cannot be read"),
    "pickle": (pickle.dumps({"K": K}), "cannot be read"),
    "dense header": (b"%%MatrixMarket matrix array real general\n2000000 2000000\n1\n", "2000000"),
    "sparse header": (
        b"%%MatrixMarket matrix coordinate real general\n2000000 2000000 1\n1 1 1\n", "2000000"
    ),
    "dense matrix cut short": (
        b"%%MatrixMarket matrix array real symmetric\n%\n12 12\n" + 77 * b"1.0\n",
        "has 77 of 78 numbers",
    ),
    "OP4 header": (op4(2_000_000), "KRED: is 2000000 x 2000000"),
    "0.5 MB that unpack to 512": (  # made where the test runs, as it takes seconds
        lambda: npz(K=np.zeros((8192, 8192)), M=K), "K: is 8192 x 8192"
    ),
}  # fmt: skip


def bad_matrices(folder, content):
    (folder / "K.dat").write_bytes(content() if callable(content) else content)
    (folder / "nodes.csv").write_text(TABLE)
    return lambda: read_reduced([folder / "K.dat"], folder / "nodes.csv")


def short_row(folder):
    reading = bad_matrices(folder, GOOD)
    (folder / "nodes.csv").write_text(TABLE + "3,c,1\n")
    return reading


def compressed_rexs(method, damage):
    def make(folder):
        data = io.BytesIO()
        with zipfile.ZipFile(data, "w", method) as archive:
            archive.writestr("a.rexs", planetary().xml())
        content = bytearray(data.getvalue())
        start = 30 + len("a.rexs") + damage
        content[start : start + 30] = bytes(30)
        (folder / "a.rexsz").write_bytes(content)
        return lambda: read_rexs(folder / "a.rexsz")

    return make


def rexs_place_without_number(folder):
    text = planetary().xml().decode()
    at = text.index("<c>", text.index("support_vector") if "support_vector" in text else 0)
    (folder / "a.rexs").write_text(text[:at] + "<c>nan" + text[text.index("</c>", at) :])
    return lambda: case_of_document(read_rexs(folder / "a.rexs"), "a.rexs", None)


OTHERS = {
    "short row of the node table": (short_row, "line 4, y_m: is empty"),
    "damaged LZMA": (compressed_rexs(zipfile.ZIP_LZMA, 20), "zip: is damaged"),
    "damaged bz2": (compressed_rexs(zipfile.ZIP_BZIP2, 10), "zip: is damaged"),
    "NaN in a position": (rexs_place_without_number, "'nan"),
}


@pytest.mark.parametrize("what", [*MATRICES, *OTHERS])
def test_damaged_files_are_one_line(tmp_path, what):
    if what in MATRICES:
        content, words = MATRICES[what]
        reading = bad_matrices(tmp_path, content)
    else:
        make, words = OTHERS[what]
        reading = make(tmp_path)
    with pytest.raises(InputError) as caught:
        reading()
    assert words in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["static", "ev-reducer", "--rigid", "all", "--set", "inputs.0.inertia_kg_m2=0"],
         "leaves stage.output 0 kg m² against turning"),
        (["modes", "lin-parker", "--set", "stage.planet.mass_kg=1e-300"],
         "stage.planet.mass_kg: leaves planets of stage 1e-300 kg"),
        (["modes", "nrel-5mw", "--set", "stages.0.carrier.mass_kg=1e-300"],
         "stages.stage_1.carrier.mass_kg"),
        (["check", "itself.toml"], "itself.toml takes its stage from itself"),
        (["check", "a.toml"], "takes its stage from itself"),
        (["check", "sun.toml"], "stage.sun: is not a section -- write it as [stage.sun]"),
        (["check", "ring.toml"], "stage.ring: is not a section"),
        (["check", "lin-parker", "--set", "inputs=1.5"], "inputs: is not a list"),
        (["check", "stages.toml"], "stages: is not a list"),
        (["static", "lin-parker", "--angle-deg", "nan"], "--angle-deg: nan rad: is no angle"),
        (["static", "lin-parker", "--torque-nm", "nan"], "--torque-nm: nan: is no torque"),
        (["simulate", "lin-parker", "--torque-share", "inf"], "--torque-share: inf: is beyond"),
        (["modes", "lin-parker", "--limit-hz", "1e300"], "--limit-hz: 1e+300: is beyond 1e+09"),
        (["response", "lin-parker", "--speed-range", "1e-300", "1"], "is not within 0.001"),
        (["response", "lin-parker", "--torque-range", "1", "1e300"], "is not within 0.001"),
        (["response", "lin-parker", "--torque", "1e300"], "is not within 0.001 and 1000"),
        (["response", "lin-parker", "--linear", "--speed", "2"], "no effect beside --linear"),
        (["response", "lin-parker", "--speed", "2"], "--speed"),
        (["modes", "lin-parker", "--campbell", "--angle-deg", "0"],
         "--angle-deg: has no effect beside --campbell, which takes the mean stiffness"),
        (["compare", "lin-parker", "--life"], "--life: has no effect without --against"),
        (["compare", "lin-parker", "--out", "a.html"], "--out: has no effect without folders"),
        (["compare", "lin-parker", "--cycles", "2", "--positions", "3"], "beside --cycles"),
        (["compare", "lin-parker", "--against", "nrel-5mw", "--cycles", "2"],
         "--cycles: has no effect beside --against"),
        (["compare", "lin-parker", "--against", "nrel-5mw", "--positions", "2"],
         "--positions: has no effect beside --against"),
        (["compare", "lin-parker", "--against", "nrel-5mw", "--out", "a.html"], "--out: has no"),
        (["compare", "a", "b", "--set", "stage.planets=3"], "beside folders of two runs"),
        (["stability", "lin-parker", "--speed-range", "1", "1e300"], "within 0.001 and 1000 times"),
        (["stability", "lin-parker", "--set", "inputs.0.speed_rpm=0"], "turn no gear mesh"),
        (["response", "lin-parker", "--linear", "--set", "inputs.0.speed_rpm=0"], "turn no gear"),
        (["simulate", "lin-parker", "--from", "no.nc"], "no.nc: dataset: there is no such file"),
    ],
)  # fmt: skip
def test_figures_that_cannot_be_are_one_line(flexgear, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    stage = '[[stages]]\nname = "a"\ncase = "{}"\n'
    for name, other in (("itself", "itself"), ("a", "b"), ("b", "a")):
        (tmp_path / f"{name}.toml").write_text(stage.format(f"{other}.toml"))
    (tmp_path / "stages.toml").write_text("stages = 5\n")
    for name, value in (("sun", '"rigid"'), ("ring", "3.5")):
        (tmp_path / f"{name}.toml").write_text(f"[stage]\n{name} = {value}\n")
    assert words in flexgear.refused(*arguments)


SENSOR = 'sensors=[{name = "a", on = "stage.sun", measures = "velocity", '
SERIES = "load_series={years = 1, torque = 'T', speed = 'n', design_load_cases = [{name = 'a', "
SETTINGS = {  # of a lumped case, and what the line says
    f'{SENSOR} direction = "radial", place_m = [1e300, 0, 0]}}]': "place_m: is 1e+300 m from",
    f"{SENSOR} vector = [1e300, 0, 0]}}]": "vector: is 1e+300 long",
    f'{SENSOR} direction = "x", place_mm = [1]}}]': "place_mm: has 1 of 3 numbers",
    f'{SENSOR} direction = "x", place_mm = [1, 2, 3, 4]}}]': "has 4 elements -- give at most 3",
    "sensors=[{name = ' ', on = 'stage.sun', measures = 'speed'}]": "' ' is not a valid name",
    "gravity_m_per_s2=[1, 2]": "has 2 of 3 numbers -- give 3 numbers",
    "faults=[{kind = 'wear', gear = 1, flank = 'drive', depth_um = 1}]":
        "gear: 1 is unknown -- use one of sun, planet",
    "held=[[['a']]]": "held[0]: [['a']] is not text",
    "stage.carrier.support.full_si=[[1e300, 0], [0, 1]]": "full_si: is not 6 x 6",
    f"stage.carrier.support.full_si={np.full((6, 6), 1e300).tolist()}": "has entries beyond 1e+16",
    f"stage.carrier.support.full_si={(np.ones((6, 6)) - 0.9999999 * K[:6, :6]).tolist()}":
        "is not positive semidefinite",
    f"{SERIES} files = 'a\\u0000*', hours_per_year = 1}}]}}".replace("'", '"'): "names no file",
}  # fmt: skip


@pytest.mark.parametrize("setting", SETTINGS)
def test_settings_that_cannot_be_are_one_line(flexgear, setting):
    command = ["spectrum", "--quiet"] if "load_series" in setting else ["check"]
    assert SETTINGS[setting] in flexgear.refused(*command, "lin-parker", "--set", setting)


def test_a_million_planets_are_refused_before_each_has_its_error(flexgear):
    errors, planets = "stage.errors.planet_thickness_um=5", "stage.planets=1000000000000"
    assert "1e+12 is outside 1 … 20" in flexgear.refused(
        "check", "lin-parker", "--set", errors, "--set", planets
    )


def test_a_run_of_damaged_files_is_one_line(tmp_path):
    (tmp_path / "summary.json").write_text("{}")
    (tmp_path / "case.json").write_text("{}")
    with pytest.raises(InputError, match=r"summary\.json: \S+ is missing"):
        read_folder(tmp_path)
    (tmp_path / "a.nc").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(500))
    with pytest.raises(FlexgearError, match="not a netCDF file of flexgear"):
        load(tmp_path / "a.nc")
    summary = json.loads('{"realtime_factor": {"a": 1}}')
    with pytest.raises(InputError, match="values are not those of a run"), complete(tmp_path):
        summary["realtime_factor"] / 2.0


@pytest.mark.slow
@pytest.mark.usefixtures("no_pixels")
def test_runs_with_a_wrong_figure_are_compared_in_one_line(flexgear, tmp_path):
    """The page reads figures that no picture does."""
    short = {"solver.duration": 0.01, "solver.settle": 0.002}
    fg.load_case("lin-parker").with_(**short).run(tmp_path)
    file = tmp_path / "summary.json"
    summary = json.loads(file.read_text())
    summary["modes"]["lowest"][1]["frequency_hz"] = []
    file.write_text(json.dumps(summary))
    page = ("--out", tmp_path / "page.html", "--no-interactive", "-q")
    flexgear.refused("compare", tmp_path, tmp_path, *page, says=["values are not those of a run"])


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
@pytest.mark.parametrize("kind", ["REXS", "FE mesh", "matrices", "cache"])
def test_nobody_waits_for_a_pipe(flexgear, tmp_path, kind):
    pipe = tmp_path / "recovery.npy"
    os.mkfifo(pipe)
    if kind == "cache":
        with pytest.raises(OSError, match="device or pipe"):
            store._checksum(pipe)
        return
    if kind == "REXS":
        code, _, err = flexgear("import", pipe, "--out", tmp_path / "case.toml")
    else:
        key = "file" if kind == "FE mesh" else "reduced"
        code, _, err = flexgear(
            "check", "wind-5mw", "--set", f"stage.ring.fe.fe_mesh={key}",
            "--set", f"stage.ring.fe.fe_mesh_file={pipe}", "--set", "stage.ring.fe.fe_mesh_unit=m",
            *(("--set", f"stage.ring.fe.fe_mesh_nodes={pipe}") if kind == "matrices" else ()),
        )  # fmt: skip
    assert code == 2 and err.count("\n") == 1
    assert "is a device or pipe" in err


def test_a_run_that_ends_before_a_sensor_has_a_sample_is_written(flexgear, tmp_path):
    sensor = 'sensors=[{name = "a", on = "stage.sun", measures = "speed"}]'
    recorder = "recorder={band_hz = 1.0}"
    flexgear.out("simulate", "lin-parker", "-q", "--duration-s", "0.01", "--set", sensor,
                 "--set", recorder, "--out", tmp_path / "a.nc")  # fmt: skip
    assert load(tmp_path / "a.nc").sizes["sensor_time"] == 0
