"""Every command on every bundled case: it works, or says in one line why it makes no sense."""

import pytest
from stage_samples import cheap_stage, stiff_stage
from train_contexts import BUNDLED

from flexgear.cli import body_commands

LUMPED = "has only lumped members"
QUICK = ["--set", "solver.fidelity=quick"]
SHORT = ["--set", "solver.settle_s=0.002", "--set", "solver.duration_s=0.005"]
STAGE_SHORT = [
    "--set", "solver.gear_mesh_orders=2",
    "--set", "solver.time_step_s=2e-4",
    "--set", "drive.rated_speed_rpm=100",
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
    "simulate": ["-q", "--duration-s", 0.004],
    "compare": ["-q"],
    "sweep": ["-q", "damping.ratio=0.01,0.02", "--measure", "frequencies", "--workers", 1,
              "--no-pictures"],
    "tolerance": ["-q", "--samples", 2, "--set", DRAWN, "--workers", 1, "--no-pictures",
                  "--set", "tolerance.positions_per_gear_mesh=4"],
    "mesh": ["-q", "--component", "ring"],
    "reduce": ["-q"],
    "run": ["-q", "--no-pictures"],
}  # fmt: skip
WRITES = ("sweep", "tolerance", "run")


@pytest.fixture(autouse=True)
def cheap(flexgear, monkeypatch, tmp_path):
    """No body is reduced, and studies are kept elsewhere."""
    monkeypatch.setenv("FLEXGEAR_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr("flexgear.solve.bodies.stage_bodies", lambda s, *_: bodies(s))
    monkeypatch.setattr("flexgear.studies.sweep.stage_bodies", lambda s, *_: bodies(s))
    for k, name in enumerate(("ring", "carrier")):
        monkeypatch.setitem(body_commands.BODIES, name, lambda s, *_, k=k: bodies(s)[k])


def bodies(stage):
    """Cheap bodies of any stage."""
    return (cheap_stage if stage.case.name == "wind-5mw" else stiff_stage)(stage)


@pytest.mark.parametrize("case", [*BUNDLED, *FLEXIBLE])
@pytest.mark.parametrize("command", COMMANDS)
def test_works_or_says_why_not(flexgear, tmp_path, command, case):
    name, *options = command.split()
    flexible = case in FLEXIBLE
    more = [*options, *COMMANDS[command]]
    if name in WRITES:
        more += ["--out", tmp_path / "out"]
    if flexible:
        more += QUICK + (FLEXIBLE[case] if name == "run" else [])
        more += ["--positions", 2] if name == "compare" else []
    elif name in ("run", "compare", "simulate"):
        more += SHORT + (["--cycles", 2] if name == "compare" else [])
    code, out, err = flexgear(name, case, *more)
    if name in ("mesh", "reduce") and not flexible:
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert err.startswith("flexgear: ") and LUMPED in err and " -- " in err
        return
    assert code == 0, err
    assert out
