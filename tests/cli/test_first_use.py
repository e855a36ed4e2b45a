"""Commands of the README, the first steps and the tutorial, as they are printed, one after the
other from an empty folder."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FENCED = r"^```\w*\n(.*?)^```"
SHOWN = 600  # seconds that a command may take
pytestmark = pytest.mark.skipif(os.name != "posix", reason="lines of a POSIX shell")


def text_of(page):
    return (ROOT / page).read_text(encoding="utf-8")


def blocks(text, start):
    """Fenced blocks whose first line begins so."""
    found = re.findall(FENCED, text, re.DOTALL | re.MULTILINE)
    return [block for block in found if block.startswith(start)]


def commands(text, start="flexgear "):
    return [line for block in blocks(text, start) for line in block.splitlines()]


def shell(line, folder, path=None):
    """What a line prints in a shell that has flexgear; it must succeed without a warning."""
    here = str(Path(sys.executable).parent)
    env = {**os.environ, "PATH": path or f"{here}{os.pathsep}{os.environ['PATH']}"}
    env["PYTHONPATH"] = str(ROOT)
    ran = subprocess.run(
        ["/bin/sh", "-c", line], cwd=folder, env=env, capture_output=True, text=True,
        timeout=SHOWN, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, f"{line}\n{ran.stderr}"
    assert "internal error" not in ran.stderr
    return ran.stdout


def is_quick(line):
    """Whether it needs no FE body."""
    return "wind-5mw" not in line or " cases " in line or " check " in line


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
def test_first_steps(tmp_path):
    lines = commands(text_of("docs/first_steps.md"))
    assert len(lines) >= 9
    for line in filter(is_quick, lines):
        assert shell(line, tmp_path)
    (code,) = re.findall(r"```python\n(.*?)```", text_of("docs/first_steps.md"), re.DOTALL)
    exec(compile(code, "first_steps.md", "exec"), {})


@pytest.mark.slow
def test_first_steps_with_fe_bodies(tmp_path):
    for line in commands(text_of("docs/first_steps.md")):
        assert shell(line, tmp_path)
    assert (tmp_path / "results/first/report.html").is_file()


def test_readme(tmp_path):
    lines = commands(text_of("README.md"))
    assert len(lines) >= 7
    for line in lines:
        if is_quick(line) and not line.startswith(("flexgear run", "flexgear sweep")):
            assert shell(line, tmp_path)


@pytest.mark.slow
def test_readme_whole(tmp_path):
    for line in commands(text_of("README.md")):
        assert shell(line, tmp_path)
    assert (tmp_path / "results/mine/report.html").is_file()


def sections(block):
    """Text of each section of a TOML block by its header."""
    parts = re.split(r"^(\[.*\])$", block, flags=re.MULTILINE)
    return {"": parts[0]} | dict(zip(parts[1::2], parts[2::2], strict=True))


def tutorial_cases():
    """The case as it stands after the chapter on errors, and with the ring that bends."""
    text = text_of("docs/tutorial.md")
    lumped, _, flexible = text.partition("## A ring that bends")
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


def lumped_lines(folder):
    """Commands of the tutorial before the ring bends, with the case in the folder."""
    (folder / "mine.toml").write_text(tutorial_cases()[0])
    return named(text_of("docs/tutorial.md").partition("## A ring that bends")[0])


@pytest.mark.slow
def test_tutorial_with_lumped_members(tmp_path):
    lines = lumped_lines(tmp_path)
    assert any(line.startswith("flexgear new draft.toml") for line in lines)
    for line in [*lines, "flexgear check draft.toml"]:
        if not line.startswith("flexgear run"):
            assert shell(line, tmp_path)


@pytest.mark.slow
def test_tutorial_runs_with_lumped_members(tmp_path):
    for line in lumped_lines(tmp_path):
        assert shell(line, tmp_path)
    assert (tmp_path / "results/mine/report.html").is_file()


@pytest.mark.slow
def test_tutorial_with_a_ring_that_bends(tmp_path):
    after = text_of("docs/tutorial.md").partition("## A ring that bends")[2]
    (tmp_path / "mine.toml").write_text(tutorial_cases()[1])
    for line in [*commands(after), *named(after)]:
        assert shell(line, tmp_path)
    assert (tmp_path / "results/mine/report.html").is_file()
