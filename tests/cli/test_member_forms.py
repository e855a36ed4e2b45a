"""Any two members, each lumped or a body of its own, go through every command."""

import json

import pytest
from report_pages import OF_RUNS, require_sound
from small_train import LUMPED_PARTS, SMALL_STAGE
from stage_samples import sources_of_bodies, stiff_stage

from flexgear.cli import exchange_commands

SHORT = (
    "stage.errors.ring_tooth_um=", "stage.errors.planet_tooth_um=", "stage.errors.sun_tooth_um=",
    "stage.errors.pin_tangential_um=[20, 0, 0, 0]", "solver.fidelity=quick",
    "solver.gear_mesh_orders=1", "solver.settle_s=2e-4", "solver.duration_s=1e-3",
)  # fmt: skip
CHOICES = {  # of any two members all four combinations
    "+".join(bends): bends
    for bends in (("ring", "carrier", "sun"), ("ring",), ("carrier",), ("sun",), ("planet",))
}
*FORMS, FE_PLANETS = CHOICES


@pytest.fixture
def case(request, flexgear, tmp_path, monkeypatch):
    """A file and settings that make lumped members of all but those of a choice; no body is
    reduced."""
    monkeypatch.setenv("FLEXGEAR_CACHE", str(tmp_path / "cache"))
    for place in ("solve.bodies", "studies.sweep"):
        monkeypatch.setattr(f"flexgear.{place}.stage_bodies", lambda s, *_: stiff_stage(s))
    monkeypatch.setattr(exchange_commands, "fe_sources", sources_of_bodies(stiff_stage))
    monkeypatch.chdir(tmp_path)
    bends = CHOICES[request.param]
    lumped = [of for name, of in LUMPED_PARTS.items() if name not in bends]
    keys = [*SHORT, *(f"{key}={value}" for of in lumped for key, value in of.items())]
    keys += ["stage.planet.fe.fixed_interface_modes=4"] * ("planet" in bends)
    return SMALL_STAGE, *(word for key in keys for word in ("--set", key))


DRAWN = "tolerance.errors.pin_tangential.standard_deviation_um=10"
COMMANDS = {
    "check": [],
    "static": ["-q", "--angle-deg", 0],
    "modes": ["-q", "--campbell"],
    "simulate": ["-q"],
    "compare": ["-q"],
    "sweep": ["-q", "damping.ratio=0.01,0.02", "--workers", 1, "--no-pictures", "--out", "swept"],
    "tolerance": ["-q", "--samples", 2, "--set", DRAWN, "--workers", 1, "--no-pictures",
                  "--set", "tolerance.positions_per_gear_mesh=4", "--out", "drawn"],
    "export": ["--rexs", "box.rexs"],
}  # fmt: skip
OF_FE_BODIES = {
    "mesh": ["-q"],
    "reduce": ["-q"],
    "export": ["--reduced", "matrices", "-q"],
}


def worked(flexgear, command, case, options):
    file, *keys = case
    code, out, err = flexgear(command, file, *options, *keys)
    assert (code, bool(out)) == (0, True), (command, err)


@pytest.mark.slow
@pytest.mark.parametrize("case", FORMS, indirect=True)
def test_every_command_takes_every_form_of_members(case, flexgear):
    for command, options in COMMANDS.items():
        worked(flexgear, command, case, options)
    file, *keys = case
    has_fe_bodies = not {"stage.ring.fe=", "stage.carrier.fe="} <= set(keys)
    for command, options in OF_FE_BODIES.items():
        code, _, err = flexgear(command, file, *options, *keys)
        assert code == (0 if has_fe_bodies else 2), (command, err)
        assert has_fe_bodies or err.count("\n") == 1


@pytest.mark.parametrize("case", [FE_PLANETS], indirect=True)
def test_commands_take_fe_planets_beside_lumped_members(case, flexgear):
    for command in ("check", "static", "modes", "simulate", "compare"):
        worked(flexgear, command, case, COMMANDS[command])


@pytest.mark.slow
@pytest.mark.usefixtures("no_pixels")
@pytest.mark.parametrize("case", ["carrier"], indirect=True)
def test_a_run_is_drawn_and_replaced_as_a_whole(case, flexgear, tmp_path):
    """A run in place of another leaves nothing of that: no report, no pictures, no datasets."""
    out = tmp_path / "out"
    flexgear.out("run", *case, "-q", "--out", out, "--no-pictures")
    first = json.loads((out / "summary.json").read_text())
    flexgear.out("render", out, "-q")
    require_sound(out / "report.html", *OF_RUNS)
    changed = ("--set", "stage.errors.pin_tangential_um=[0, 0, 0, 0]", "--no-pictures")
    assert flexgear("run", *case, "-q", "--out", out, *changed)[0] == 0
    assert not (out / "report.html").exists() and not (out / "pictures").exists()
    assert "transient_without_errors.nc" not in {f.name for f in out.iterdir()}
    assert json.loads((out / "summary.json").read_text())["content_hash"] != first["content_hash"]
