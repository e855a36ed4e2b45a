"""Every command on bundled cases: it works, or says in one line why it makes no sense."""

import json
import re

import jsonschema
import pytest
import typer
from coupled import CLEAN
from matplotlib.backends.backend_agg import FigureCanvasAgg
from stage_samples import bodies_of, sources_of_bodies
from train_contexts import BUNDLED

from flexgear.cli import exchange_commands
from flexgear.cli.entry import app, run
from flexgear.face.runs import read_run
from flexgear.model.load import bundled_cases, load_case
from flexgear.results import dataset_file
from flexgear.results.summary import json_schema
from flexgear.solve.bodies import stage_bodies
from flexgear.solve.headlines import rows_schema
from flexgear.views.chart import planned
from flexgear.views.interactive import panels_of
from flexgear.views.run_charts import RUN_CHARTS

SUMMARY_SCHEMA = json_schema({"headlines": rows_schema()})
LUMPED = "has only lumped members"
NO_SLICES = "knows no load along the face"
QUICK = ["--set", "solver.fidelity=quick"]
SHORT = ["--set", "solver.settle_s=0.002", "--set", "solver.duration_s=0.005"]
COARSE = ["--set", "solver.positions_per_gear_mesh=4"]
STAGE_SHORT = [
    "--set", "solver.gear_mesh_orders=2",
    "--set", "solver.time_step_s=2e-4",
    "--set", "solver.duration_s=0.05",
    "--set", "drive.steps.torques_nm=[]",
]  # fmt: skip
FAST_SHORT = [
    "--set", "solver.gear_mesh_orders=1",
    "--set", "solver.duration_s=0.002",
    "--set", "drive.steps.torques_nm=[]",
]  # fmt: skip
FLEXIBLE = {
    "wind-5mw": STAGE_SHORT,
    "ev-reducer": FAST_SHORT,
    "star-ring": FAST_SHORT,
    "grc-750kw": FAST_SHORT,
}
DRAWN = "tolerance.errors.pin_tangential.standard_deviation_um=10"
COMMANDS = {
    "check": [],
    "static": ["-q"],
    "modes": ["-q", "--limit-hz", 100],
    "modes --campbell": ["-q", "--limit-hz", 100],
    "stability": ["-q", "--count", 3],
    "response": ["-q", "--speed-range", 0.98, 1.0, "--harmonics", 2],
    "simulate": ["-q", "--duration-s", 0.004],
    "compare": ["-q"],
    "sweep": ["-q", "damping.ratio=0.01,0.02", "--measure", "frequencies", "--workers", 1,
              "--no-pictures"],
    "tolerance": ["-q", "--samples", 2, "--set", DRAWN, "--workers", 1, "--no-pictures",
                  "--set", "tolerance.positions_per_gear_mesh=4"],
    "rate": ["-q", "--workers", 1, "--no-pictures", "--set", "rating.gear_mesh_cycles=1",
             "--set", "rating.positions_per_gear_mesh=2"],
    "mesh": ["-q", "--component", "ring"],
    "reduce": ["-q"],
    "export --rexs": [],
    "export --reduced": ["-q"],
    "modify": ["-q"],
    "spectrum": ["-q"],
}  # fmt: skip
WRITES = ("sweep", "tolerance", "rate")
OF_A_RUN = {"run", "render"}
PLANETARY = re.compile("stage_[12]")  # of double-rotor-5mw
# README: wind-5mw; test_run_and_compare: herringbone
DRAWN_CASES = ("double-rotor-5mw", "star-ring", "grc-750kw")
# what these commands solve of the other cases test_every_case and run_of_case solve, too
SOME_CASES = {
    **dict.fromkeys(("simulate", "compare", "sweep", "tolerance", "rate"),
                    ("herringbone", "wind-5mw")),
    "modes --campbell": ("herringbone", "star-ring"),
    "stability": ("herringbone", "wind-5mw"),
    "response": ("herringbone", "lin-parker"),  # FE bodies take some seconds a state
}  # fmt: skip
OF_NO_CASE = {"cache", "cases", "doctor", "import", "new", "orders", "schema", "upgrade"}


def on_cheap_bodies(patch, cache):
    """No body is reduced, and studies are kept elsewhere."""
    patch.setenv("FLEXGEAR_CACHE", str(cache))
    patch.setattr("flexgear.solve.bodies.stage_bodies", lambda s, *_: bodies_of(s))
    patch.setattr("flexgear.studies.sweep.stage_bodies", lambda s, *_: bodies_of(s))
    patch.setattr(exchange_commands, "fe_sources", sources_of_bodies(bodies_of))


@pytest.fixture(autouse=True)
def cheap(flexgear, monkeypatch, tmp_path):
    on_cheap_bodies(monkeypatch, tmp_path / "cache")


@pytest.fixture(scope="module", params=[*BUNDLED, *FLEXIBLE])
def run_of_case(request, tmp_path_factory):
    """Name of a case and the folder of its run, without pictures."""
    out = tmp_path_factory.mktemp("runs") / request.param
    options = ["-q", "--no-pictures", *short("run", request.param), "--out", str(out)]
    with pytest.MonkeyPatch.context() as patch:
        on_cheap_bodies(patch, out.parent / "cache")
        assert run(["run", request.param, *options]) == 0
    return request.param, out


def test_no_command_and_no_case_is_left_out():
    commands = {command.split()[0] for command in COMMANDS} | OF_A_RUN | OF_NO_CASE
    assert commands == set(typer.main.get_command(app).commands)
    assert {*BUNDLED, *FLEXIBLE} == set(bundled_cases())


def why_not(command, case):
    """What the one line says where a command makes no sense for a case, else nothing."""
    if command in ("mesh", "reduce", "export --reduced") and case not in FLEXIBLE:
        return LUMPED
    if command == "spectrum" and not load_case(case).load_cases:
        return "load_cases: is missing"
    return NO_SLICES if command == "modify" else ""


def short(name, case):
    """Options that keep a command short."""
    if case in FLEXIBLE:
        positions = ["--positions", 2] if name == "compare" else []
        return QUICK + COARSE + (FLEXIBLE[case] if name == "run" else []) + positions
    if name in ("run", "compare", "simulate"):
        return SHORT + COARSE + (["--cycles", 2] if name == "compare" else [])
    return []


@pytest.mark.parametrize(
    ("options", "coarse"),
    [([], True), (["--rigid", "ring"], False), (["--set", "solver.fidelity=standard"], False)],
)
def test_modes_say_how_high_frequencies_of_coarse_rims_are(flexgear, options, coarse):
    text = flexgear.out("modes", "wind-5mw", *QUICK, *options, "--limit-hz", 100)
    assert ("up to 4.4 % high" in text) == coarse


@pytest.mark.slow
@pytest.mark.parametrize("rigid", [[], ["--rigid", "planet"]])
def test_modes_say_so_of_planets_with_fe_meshes(flexgear, monkeypatch, rigid):
    monkeypatch.setattr("flexgear.solve.bodies.stage_bodies", stage_bodies)
    bodies = ["--set", "stage.planet.fe.flexible=true", "--rigid", "ring", "--rigid", "carrier"]
    text = flexgear.out("modes", "wind-5mw", *QUICK, *bodies, *rigid, "--limit-hz", 100)
    assert ("up to 4.4 % high" in text) == (not rigid)


@pytest.mark.parametrize(
    ("command", "case"),
    [
        (command, case)
        for command in COMMANDS
        for case in (*BUNDLED, *FLEXIBLE)
        if case in SOME_CASES.get(command, (case,))
    ],
)
def test_every_command_works_on_a_case_or_refuses_it_in_one_line(flexgear, tmp_path, command, case):
    name, *options = command.split()
    more = [*COMMANDS[command], *short(name, case)]
    if name in WRITES:
        more += ["--out", tmp_path / "out"]
    if name == "export":
        options.append(tmp_path / "box.rexs")
    code, out, err = flexgear(name, case, *options, *more)
    if reason := why_not(command, case):
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert err.startswith("flexgear: ") and reason in err and " -- " in err
        return
    assert code == 0, err
    assert out


def test_waves_of_stiffness_act_on_fe_rings(flexgear, tmp_path):
    """They have no tooth pairs, of which commands say nothing; a measure of pairs is refused."""
    wave = ["wind-5mw", "-q", *QUICK, *COARSE, "--set", "stage.gear_mesh.model=rectangular"]
    text = flexgear.out("simulate", *wave, "--duration-s", 0.004)
    assert "mean force of the ring gear meshes" in text and "tooth" not in text
    assert "–" in flexgear.out("compare", *wave, "--positions", 2).splitlines()[-1]
    options = ["--no-pictures", *STAGE_SHORT, "--out", tmp_path / "run"]
    flexgear.out("run", *wave, *options)
    summary = json.loads((tmp_path / "run/summary.json").read_text(encoding="utf-8"))
    jsonschema.validate(summary, SUMMARY_SCHEMA)
    assert summary["steady"]["stage"]["ring_pairs_in_contact"] == {}
    options = ["--no-pictures", "--workers", 1, "--measure", "tooth_load"]
    code, _, err = flexgear("sweep", *wave, "damping.ratio=0.01,0.02", *options)
    assert code and "waves of stiffness have no tooth pairs" in err


def test_every_figure_of_a_run_is_written_down(run_of_case):
    summary = json.loads((run_of_case[1] / "summary.json").read_text(encoding="utf-8"))
    jsonschema.validate(summary, SUMMARY_SCHEMA)


@pytest.mark.slow
@pytest.mark.parametrize("run_of_case", DRAWN_CASES, indirect=True)
def test_every_kind_of_run_is_drawn(flexgear, run_of_case, tmp_path, request, monkeypatch):
    """With pixels what only a train without a flexible stage has: figures of its bearings, of all
    stages, and of the parallel one."""
    case, folder = run_of_case
    pictures = tmp_path / "pictures"
    with_pixels = case == "double-rotor-5mw"
    draw = FigureCanvasAgg.print_png
    request.getfixturevalue("no_pixels")
    if with_pixels:
        dot = FigureCanvasAgg.print_png
        monkeypatch.setattr(
            FigureCanvasAgg,
            "print_png",
            lambda figure, to, **how: (dot if PLANETARY.search(to.name) else draw)(
                figure, to, **how
            ),
        )
    code, out, err = flexgear("render", folder, "-q", "--no-interactive", "--out", pictures)
    assert (code, out) == (0, f"drew {case} into {pictures}\n"), err
    assert (pictures / "report.html").stat().st_size > (1e5 if with_pixels else 3e4)


@pytest.mark.slow
@pytest.mark.parametrize("run_of_case", ["lin-parker"], indirect=True)
def test_comparisons_of_large_files_are_those_of_small_ones(
    flexgear, run_of_case, tmp_path, monkeypatch
):
    """Files of runs are read whole, or by slices where they are large: pages are the same, byte by
    byte, but for pictures, of which the next test is."""
    monkeypatch.setattr("flexgear.cli.pictures.planned", lambda *_: {})
    page, pages, folder = tmp_path / "two.html", [], run_of_case[1]
    for whole in (dataset_file.MAX_IN_MEMORY, 0):
        monkeypatch.setattr(dataset_file, "MAX_IN_MEMORY", whole)
        flexgear.out("compare", folder, folder, "-q", "--no-interactive", "--out", page)
        pages.append(page.read_bytes())
    assert pages[0] == pages[1]


@pytest.mark.parametrize("run_of_case", ["wind-5mw"], indirect=True)
def test_pictures_of_large_files_show_the_same(run_of_case, monkeypatch):
    """What matplotlib gets, without the time that it takes to draw it; from a notebook, too."""
    shown = []
    for whole in (dataset_file.MAX_IN_MEMORY, 0):
        monkeypatch.setattr(dataset_file, "MAX_IN_MEMORY", whole)
        left = read_run(run_of_case[1])
        plots = left.datasets["transient"].fg.plot
        charts = {name: panels_of(getattr(plots, name)()) for name in dir(plots)}
        for name, picture in planned(left, RUN_CHARTS).items():
            if not picture.slow and name not in charts:
                charts[name] = panels_of(picture.draw())
        shown.append(charts)
    assert shown[0] == shown[1] and len(shown[0]) > 10


@pytest.mark.slow
def test_figures_of_load_along_the_face_are_written_down(flexgear, tmp_path):
    keys = {"stage.gear_mesh.model": "face_load", "stage.gear_mesh.slices": "5", **CLEAN}
    sets = [word for key, value in keys.items() for word in ("--set", f"{key}={value}")]
    options = ["-q", "--no-pictures", *short("run", "wind-5mw"), *sets, "--json"]
    summary = json.loads(flexgear.out("run", "wind-5mw", *options, "--out", tmp_path / "out"))
    assert summary["face_load"]["flexible"]
    jsonschema.validate(summary, SUMMARY_SCHEMA)
