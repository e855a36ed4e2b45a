"""Commands about cases: check one, list, print or copy the bundled ones."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from flexgear.cli.display import present, table
from flexgear.cli.options import AsJson, CaseName, Settings, read_case
from flexgear.cli.outputs import file_option
from flexgear.cli.train_check import derived_of_train, running_sections
from flexgear.coupling.pace import pace_sections, stage_pace
from flexgear.files.atomic import file_target, write_bytes
from flexgear.gears.power_flow import power_flow
from flexgear.gears.report import stage_report
from flexgear.model.bundled import bundled_cases, bundled_text
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.flexible_stage import FlexibleStage
from flexgear.model.load import load_case

RPM = 60 / (2 * math.pi)


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.command()(check)
    app.command()(cases)


def check(case: CaseName, settings: Settings = None, as_json: AsJson = False) -> None:
    """Validate a case and print what follows from it: geometry, speeds, torques, forces."""
    found = read_case(case, settings, loaded=False)
    if isinstance(found, Case):
        present(f"{found.name}: {found.title or 'valid'}", derived_of_train(found), as_json)
        return
    present(f"{found.name}: {found.title or 'valid'}", derived(found), as_json)


def derived(case: FlexibleStage) -> dict[str, dict[str, Any]]:
    """Derived geometry, phasing, speeds and forces by section; InputError where gears misfit."""
    alone = case.as_case()
    flow = power_flow(alone)
    motion = flow.stages[0]
    sections = stage_report(case.view(), motion.gear_mesh_forces)
    sections["kinematics"] = {
        "carrier_speed_rpm": motion.carrier_speed * RPM,
        "sun_speed_rpm": motion.sun_speed * RPM,
        "planet_speed_rpm": motion.planet_speed * RPM,
        "gear_mesh_frequency_hz": motion.gear_mesh_frequency,
        "input_torque_nm": motion.carrier_torque,
        "output_torque_nm": -motion.sun_torque,
        "ring_torque_nm": -motion.ring_torque,
        "expected_ring_mesh_force_n": motion.ring_gear_mesh_force,
        "expected_sun_mesh_force_n": motion.sun_gear_mesh_force,
    }
    sections |= running_sections(alone, flow)
    sections |= pace_sections(stage_pace(case), case.solver)
    sections["case"] = {"name": case.name, "content_hash": case.content_hash()}
    return sections


def cases(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="A bundled case.")] = None,
    copy: Annotated[Path | None, file_option("--copy", "Write the case to a new file.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
) -> None:
    """List the bundled cases, print one, or copy it to a file that you edit."""
    names = bundled_cases()
    if name is None:
        if copy is not None:
            raise InputError("--copy", str(copy), "needs a case", f"name one of {', '.join(names)}")
        table("bundled cases", {n: load_case(n).title for n in names})
        return
    if name not in names:
        raise InputError("cases", name, "is not bundled", f"name one of {', '.join(names)}")
    if copy is None:
        typer.echo(bundled_text(name), nl=False)
        return
    if file_target(copy).exists() and not force:
        raise InputError("--copy", str(copy), "is there already", "choose a new name, or --force")
    write_bytes(copy, bundled_text(name).encode())
    typer.echo(f"wrote {copy}; edit it, then: flexgear check {copy}")
