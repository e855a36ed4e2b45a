"""Lines of README and pages of the manual as a stranger types them; each page in one process."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from report_pages import OF_RUNS, require_sound
from small_train import SMALL_STAGE
from stage_samples import cheap_stage, sources_of_bodies, stiff_stage
from trains import STAGE

import flexgear as fg
from flexgear.cli import exchange_commands
from flexgear.cli.entry import COMMANDS
from flexgear.model.load import bundled_text

ROOT = Path(__file__).parents[2]
FENCED = r"^```\w*\n(.*?)^```"
pytestmark = pytest.mark.skipif(os.name != "posix", reason="lines of a POSIX shell")


def text_of(page):
    return (ROOT / page).read_text(encoding="utf-8")


def blocks(text, start):
    """Fenced blocks whose first line begins so."""
    texts = re.findall(FENCED, text, re.DOTALL | re.MULTILINE)
    return [block for block in texts if block.startswith(start)]


def commands(text, start="flexgear "):
    return [line for block in blocks(text, start) for line in block.splitlines()]


def shell(line, folder, path=None):
    """What a line prints in a shell that has flexgear; it must succeed."""
    scripts = str(Path(sys.executable).parent)
    env = {**os.environ, "PATH": path or f"{scripts}{os.pathsep}{os.environ['PATH']}"}
    env["PYTHONPATH"] = str(ROOT)
    ran = subprocess.run(
        ["/bin/sh", "-c", line], cwd=folder, env=env, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, f"{line}\n{ran.stderr}"
    return ran.stdout


SHORTLY = (
    "--set solver.duration_s=0.1 --set solver.settle_s=0.05 --set drive.steps.torques_nm=[2e6]"
    " --set drive.steps.start_s=0.02 --set drive.steps.duration_s=0.01"
)
BRIEFLY = "--set solver.duration_s=0.02 --set solver.settle_s=0.01"


@pytest.fixture
def typed(flexgear_with_fe, monkeypatch, tmp_path):
    """Runs a line in ``tmp_path``, of a flexible stage with less time to simulate, of a sweep with
    fewer points."""
    monkeypatch.chdir(tmp_path)

    def run(line, more=""):
        line = line.partition("#")[0].replace(":11", ":2")
        program, *words = shlex.split(f"{line} {more}")
        assert program == "flexgear" and flexgear_with_fe.out(*words), line

    return run


@pytest.mark.skipif(sys.prefix == sys.base_prefix, reason="not in a virtual environment")
@pytest.mark.parametrize("page", ["README.md", "docs/first_steps.md"])
def test_the_line_after_the_installation_makes_flexgear_a_command(tmp_path, page):
    (tmp_path / ".venv").symlink_to(sys.prefix)
    (line,) = commands(text_of(page), ". ")
    bare = f"/usr/bin{os.pathsep}/bin"
    with pytest.raises(AssertionError):
        shell("flexgear --version", tmp_path, bare)
    assert shell(f"{line}\nflexgear --version", tmp_path, bare)


@pytest.mark.slow
@pytest.mark.usefixtures("no_pixels")
def test_first_steps(tmp_path, typed):
    lines = commands(text_of("docs/first_steps.md"))
    assert len(lines) >= 9
    more = f"--no-pictures {BRIEFLY} --set drive.steps.torques_nm=[]"
    for line in lines:
        typed(line, more if "run wind-5mw" in line else "")
    assert (tmp_path / "results/first/summary.json").is_file()
    (code,) = re.findall(r"```python\n(.*?)```", text_of("docs/first_steps.md"), re.DOTALL)
    exec(compile(code, "first_steps.md", "exec"), {})


@pytest.mark.slow
def test_readme(tmp_path, typed):
    lines = commands(text_of("README.md"))
    assert len(lines) >= 7
    more = {"run mine.toml": SHORTLY, "run pitch-drive": "--no-pictures"}
    for line in lines:
        typed(line, next((options for run, options in more.items() if run in line), ""))
    out = tmp_path / "results/mine"
    assert {p.name for p in (out / "pictures").iterdir()} >= {
        "ring_star.png", "ring_tooth_loads.png", "tooth_node_1.png", "load_sharing.png",
        "torque_step_2e6.png", "ring_star_turning.gif",
    }  # fmt: skip
    require_sound(out / "report.html", *OF_RUNS, "bearings", "deflections")


def sections(block):
    """Text of each section of a TOML block by its header."""
    parts = re.split(r"^(\[.*\])$", block, flags=re.MULTILINE)
    return {"": parts[0]} | dict(zip(parts[1::2], parts[2::2], strict=True))


def tutorial_cases():
    """The case after the chapter on errors, and with the flexible ring."""
    text = text_of("docs/tutorial.md")
    lumped, _, flexible = text.partition("## A flexible ring")
    case = {}
    for block in re.findall(r"```toml\n(.*?)```", lumped, re.DOTALL):
        case |= sections(block)
    whole = dict(case)
    del whole["[stage.ring.support]"]  # as the text says
    for block in re.findall(r"```toml\n(.*?)```", flexible, re.DOTALL):
        whole |= sections(block)
    return ["".join(f"{header}\n{body}" for header, body in one.items()) for one in (case, whole)]


def named(text):
    """Commands inside sentences of the tutorial."""
    return [" ".join(line.split()) for line in re.findall(r"`(flexgear [^`]+)`", text)]


@pytest.mark.slow
@pytest.mark.usefixtures("no_pixels")
def test_tutorial_with_lumped_members(tmp_path, typed):
    (tmp_path / "mine.toml").write_text(tutorial_cases()[0])
    lines = named(text_of("docs/tutorial.md").partition("## A flexible ring")[0])
    assert any(line.startswith("flexgear new draft.toml") for line in lines)
    for line in [*lines, "flexgear check draft.toml"]:
        typed(line)
    assert (tmp_path / "results/mine/report.html").is_file()


@pytest.mark.slow
@pytest.mark.usefixtures("no_pixels")
def test_tutorial_with_a_ring_that_bends(tmp_path, typed):
    after = text_of("docs/tutorial.md").partition("## A flexible ring")[2]
    (tmp_path / "mine.toml").write_text(tutorial_cases()[1])
    for line in [*commands(after), *named(after)]:
        typed(line, BRIEFLY if "run " in line else "")
    assert (tmp_path / "results/mine/report.html").is_file()


def stage_with(parts, gear_mesh):
    """TOML text of a lumped stage on rollers with tooth pairs, and blocks of a page."""
    rollers = "count = 12, length_mm = 12, clearance_um = 10"
    bearing = f'rolling = "roller"\nrollers = {{ {rollers} }}\n'
    bearing += "elements = { diameter_mm = 12, pitch_diameter_mm = 60 }"
    text = STAGE.format(planets=4, helix=0, sun=1e8) + "".join(parts)
    text = "".join(line for line in text.splitlines(True) if "_stiffness_n_per_m" not in line)
    text = text.replace("radial_n_per_m = 5e8", f"radial_n_per_m = 5e8\n{bearing}")
    contact = 'contact_law = "one-sided"'
    return text.replace('model = "constant"', f'model = "{gear_mesh}"\n{contact}')


@pytest.mark.usefixtures("no_pixels")
def test_blocks_on_faults(tmp_path, typed):
    """All faults in one case; the data set of a sound gearbox with a sensor, by command and in
    Python, since a crack's FE segment takes long."""
    page = text_of("docs/howto/faults.md")
    (faults,) = blocks(page, "[[faults]]")
    (tmp_path / "all.toml").write_text(stage_with([faults], "face_load"))
    assert set(fg.load_case(tmp_path / "all.toml").faults) and faults.count("[[faults]]") == 5
    typed("flexgear check all.toml")
    sensor = '[[sensors]]\nname = "probe"\non = "stage.sun"\nmeasures = "displacement"\n'
    crack = "[[faults]]" + faults.split("[[faults]]")[1]
    solver = "[solver]\nduration_s = 0.02\nsettle_s = 0.005\n"
    (tmp_path / "mine.toml").write_text(
        stage_with([crack, sensor, 'direction = "x"\n', solver], "lumped")
    )
    (line,) = blocks(page, "flexgear sweep")
    typed(line.replace("\\\n", " ").replace("0,0.5,1,1.5,2", "0").replace(":5", ":2"))
    (code,) = blocks(page, "import flexgear")
    names: dict = {}
    exec(code.replace("[0, 1, 2]", "[0]").replace('mm": 1}', 'mm": 0}'), names)
    assert fg.open_dataset(tmp_path / "data/sweep.nc")["sensor_signal"].sizes["sensor"] == 1
    assert names["one"].sizes["sample"] > 100


def test_blocks_on_tolerances(tmp_path, typed):
    """Errors of a train of two planetary stages, and modifications of one with slices."""
    errors, flanks = blocks(text_of("docs/tolerance.md"), "[tolerance")
    two = errors.replace("samples = 1000", "samples = 2")
    (tmp_path / "train.toml").write_text(bundled_text("nrel-5mw") + two)
    typed("flexgear tolerance train.toml --out study")
    relief = "[stage.sun.modifications.tip_relief]\namount_um = 60\nlength_mm = 1\n"
    (tmp_path / "flanks.toml").write_text(
        stage_with([relief, "[tolerance]\nsamples = 2\n", flanks], "face_load")
    )
    typed("flexgear check flanks.toml")


def test_blocks_on_exchange(tmp_path, typed, monkeypatch):
    """What one block writes is read by another; bodies are stiff ones, in metres."""
    page = text_of("docs/exchange.md")
    for line in commands(page, "flexgear export nrel"):
        typed(line)
    shutil.copy(tmp_path / "nrel.rexs", tmp_path / "gearbox.rexs")
    for line in commands(page, "flexgear import"):
        typed(line)
    monkeypatch.setattr(exchange_commands, "fe_sources", sources_of_bodies(stiff_stage))
    for line in commands(page, "flexgear export wind"):
        typed(line)
    monkeypatch.chdir(tmp_path / "out")
    (code,) = blocks(page, "from flexgear")
    exec(code.replace('"mm"', '"m"'), {})


def test_blocks_on_an_fe_mesh(tmp_path, typed):
    """The pattern that the page exports, scaled to mm and turned, is the FE mesh of the case."""
    page, case = text_of("docs/howto/fe_mesh.md"), SMALL_STAGE.read_text(encoding="utf-8")
    (tmp_path / "stage.toml").write_text(case)
    *mesh, check = named(page)
    for line in mesh:
        typed(line.replace("CASE", "stage.toml"))
    text = (tmp_path / "ring.inp").read_text()
    head, nodes, tail = re.split(r"(?<=NALL\n)|(?=\*ELEMENT)", text, maxsplit=2)
    turned = []
    for node in nodes.splitlines():
        number, x, y, z = map(float, node.split(","))
        turned.append(f"{number:.0f}, {1e3 * y!r}, {-1e3 * x!r}, {1e3 * z!r}\n")
    (tmp_path / "ring.inp").write_text("".join([head, *turned, tail]))
    (block,) = blocks(page, "[stage.ring.fe]")
    (tmp_path / "mine.toml").write_text(case.replace("[stage.ring.fe]\n", block))
    typed(f"{check} mine.toml")


README = Path(__file__).parents[2] / "README.md"
TEXT = README.read_text(encoding="utf-8")


SHORT = "solver__duration_s=0.05, solver__settle_s=0.01, drive__steps__torques_nm=[]"


@pytest.mark.slow
@pytest.mark.usefixtures("no_pixels")
def test_python_lines(monkeypatch, tmp_path):
    """As they are printed, but for short runs; every result has its picture or page."""
    (code,) = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    assert len([line for line in code.splitlines() if line.strip()]) <= 15
    monkeypatch.setattr("flexgear.solve.bodies.stage_bodies", lambda stage, *_: cheap_stage(stage))
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    short = code.replace("duration=0.5", "duration=0.02").replace(
        "planets=5", f"planets=5, {SHORT}"
    )
    exec(compile(short, str(README), "exec"), names)
    assert {"ring_star", "ring_profile"} <= set(dir(names["eq"].fg.plot))
    star = fg.stage_part(names["eq"], "stage").tooth_displacement.values[0]
    orders = abs(fg.radial_harmonics(star))[:11]
    assert orders[5] > 10 * np.delete(orders, [0, 5, 10]).max()
    assert names["run"].pair_load.max() > 1e5
    assert (tmp_path / "results" / "own" / "report.html").stat().st_size > 1e5


def test_commands_exist():
    named = set(re.findall(r"^\| `(\w+)` \|", TEXT, re.MULTILINE))
    assert named and named <= set(COMMANDS)


def test_pictures_exist():
    for picture in re.findall(r"!\[[^]]*\]\(([^)]+)\)", TEXT):
        assert (README.parent / picture).is_file()
