"""Commands about cases: check, list, print, copy and upgrade them, and their JSON schema."""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from typer import Argument, Option

from flexgear.cli import options
from flexgear.cli.display import as_json_text, present, table, warn
from flexgear.coupling.build import build_system, rigid_system
from flexgear.coupling.machines import machine_words
from flexgear.coupling.pace import case_pace, pace_sections
from flexgear.files.atomic import file_target, staged_folder, write_bytes, write_json
from flexgear.gears.bearings.nominal import is_alone
from flexgear.gears.expected_lines import expected_lines, line_rows
from flexgear.gears.implausible import implausible
from flexgear.gears.load_bins import bins_of_load_cases
from flexgear.gears.power_flow import PowerFlow, power_flow
from flexgear.gears.report import case_reports
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.input_file import MAX_CASE_BYTES, read_bytes, read_text
from flexgear.model.load import bundled_cases, bundled_text, load_case
from flexgear.model.schema import json_schema
from flexgear.model.units import RPM
from flexgear.model.upgrade import upgraded
from flexgear.results.origin import origin_of_case
from flexgear.results.report.parts import row_of
from flexgear.results.report.wording import with_unit
from flexgear.results.stage_figures import nominal_figures
from flexgear.solve.angles import StageMotion, stage_motions


def check(
    case: options.CaseName,
    settings: options.Settings = None,
    out: Annotated[
        Path | None,
        options.folder_option("Folder for the figures as JSON and pictures of modified flanks."),
    ] = None,
    force: options.Force = False,
    as_json: options.AsJson = False,
) -> None:
    """Validate a case and print what follows from it: geometry, speeds, torques, forces.

    Implausible values, such as colliding planets or stress beyond any steel, are warnings.
    """
    source = options.read_case(case, settings, loaded=False)
    bins_of_load_cases(source)  # refuses impossible ones
    if out is not None:
        options.claim_folder(out, options.CHECK, origin_of_case(source, "check"), force)
    figures, doubts = derived(source), implausible(source, power_flow(source))
    if out is not None:
        _write(out, source, figures, doubts)
    if as_json:
        typer.echo(as_json_text({**figures, "warnings": doubts}))
    else:
        present(f"{source.name}: {source.title or 'valid'}", with_reasons(figures))
        command = ["flexgear", "modes" if source.output is None else "run", case]
        command += [word for setting in settings or [] for word in ("--set", setting)]
        typer.echo(f"\nnext: {shlex.join(command)}")
    warn(doubts)


def _write(folder: Path, case: Case, figures: Sections, doubts: Sequence[str]) -> None:
    """Write figures, and pictures of modified flanks, in place of earlier ones."""
    from flexgear.results.run_folder import Run
    from flexgear.views.chart import flanks, planned
    from flexgear.views.run_charts import FLANK
    from flexgear.views.style import save_figure

    plan = planned(Run(case, power_flow(case), {}, {}, {}), [(flanks, [FLANK])])
    head = {"result": "check", "case": case.name, "content_hash": case.content_hash()}
    with staged_folder(folder, options.earlier(options.CHECK)) as stage:
        content = {**head, "figures": figures, "warnings": list(doubts)}
        write_json(stage / "summary.json", content)
        for name, picture in plan.items():
            save_figure(picture.draw(), stage / f"{name}.png")


def cases(
    name: Annotated[str | None, Argument(metavar="[NAME]", help="A bundled case.")] = None,
    copy: Annotated[Path | None, options.file_option("Write the case to a new file.")] = None,
    force: options.ForceNew = False,
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
    options.require_new(copy, "--copy", force)
    write_bytes(copy, options.with_schema(bundled_text(name), copy))
    typer.echo(f"wrote {copy}; edit it, then: flexgear check {copy}")


def upgrade(
    file: Annotated[Path, Argument(metavar="FILE", help="A case of an earlier version.")],
    out: Annotated[Path | None, options.file_option("Leave FILE alone, write this one.")] = None,
    force: options.ForceNew = False,
) -> None:
    """Write a case file of an earlier version in the form of this one, with its comments.

    FILE is replaced; its earlier content is kept beside it under its name with .orig added.
    """
    text = read_text(file)
    present = upgraded(text, str(file))
    if present == text:
        typer.echo(f"{file} has the present form already")
        return
    written = out or file.with_name(f"{file.name}.orig")
    options.require_new(written, "upgrade", force, "move it away, or --force")
    write_bytes(written, (text if out is None else present).encode())
    if out is None:
        write_bytes(file, present.encode())
    original = f"; its earlier content is in {written}" if out is None else ""
    typer.echo(f"wrote {out or file}{original}")
    load_case(out or file)  # reports errors that the earlier version did not


def schema(
    summary: Annotated[bool, Option("--summary", help="Of summary.json of a run.")] = False,
    out: Annotated[Path | None, options.file_option("Write it to a file.")] = None,
) -> None:
    """JSON schema of case files: keys, units, ranges and meanings, for editors of TOML; or of the
    summary.json of a run.

    An editor that knows taplo (Even Better TOML in VS Code) completes, explains and checks the keys
    of a case that begins with the line "#:schema ./flexgear.schema.json".
    """
    content = json_schema()
    if summary:
        from flexgear.results.summary import json_schema as summary_schema
        from flexgear.solve.headlines import rows_schema

        content = summary_schema({"headlines": rows_schema()})
    text = json.dumps(content, indent=1, ensure_ascii=False) + "\n"
    if out is None:
        typer.echo(text, nl=False)
        return
    target = file_target(out)
    title = content["title"].encode()
    if target.exists() and title not in read_bytes(target, "--out", MAX_CASE_BYTES):
        kind = "summaries" if summary else "cases"
        problem = f"is there and no schema of {kind}"
        raise InputError("--out", str(out), problem, "choose a new name")
    write_bytes(out, text.encode())
    if summary:
        typer.echo(f"wrote {out}")
        return
    typer.echo(f"wrote {out}; begin cases beside it with the line: #:schema ./{out.name}")


ROUNDING = 1e-9
Sections = dict[str, dict[str, Any]]


def derived(case: Case) -> Sections:
    """All figures that ``check`` derives from a case, by section. InputError or FlexgearError for a
    train that cannot run."""
    flow = power_flow(case)
    running = {} if case.output is None else _running(case, flow)
    return {
        **{
            f"{stage} {name}".strip(): section
            for stage, report in case_reports(case).items()
            for name, section in report.items()
        },
        **_expected(case, flow),
        "speeds_rpm": {m: w * RPM for m, w in flow.speed.items()},
        **running,
        **_rayleigh(case),
        "system": _system(case),
        "case": {"name": case.name, "content_hash": case.content_hash()},
    }


def _expected(case: Case, flow: PowerFlow) -> Sections:
    """Frequencies, Hz, that are expected in spectra of a sensor on the housing, by stage."""
    lines = expected_lines(case, flow)
    rows = {stage.name: line_rows(lines, stage.name) for stage in case.stages}
    title = "expected_lines_of_a_sensor_on_the_housing_hz"
    return {f"{name} {title}" if len(rows) > 1 else title: r for name, r in rows.items() if r}


def _running(case: Case, flow: PowerFlow) -> Sections:
    """Sections of the printout from torques and speeds: members, stages, the whole train."""
    motions = stage_motions(case, flow)
    sections: Sections = {
        "torques_on_the_stages_nm": dict(flow.branch_torque),
        "powers_into_the_stages_w": dict(flow.branch_power),
        "torques_from_outside_nm": dict(flow.torque),
    }
    for stage, motion in zip(flow.stages, motions, strict=True):
        before = f"{stage.name} " if len(flow.stages) > 1 else ""
        rows = nominal_figures(case.view(stage.name), stage) | _error_cycle(motion)
        for part in ("pinion", "gear") if stage.kind == "parallel" else ():
            if not is_alone(case.view(stage.name), part):
                rows[f"bearings_of_the_{part}"] = "on a shaft with others: loads by flexgear static"
        sections[f"{before}running"] = rows
    sections["machines"] = dict(machine_words(case))
    sections["power"] = {
        "independent_speeds": flow.mobility,
        "input_power_w": flow.input_power,
        "circulating_power_w": flow.circulating_power,
    }
    pace = case_pace(case)
    sections |= pace_sections(pace, case.solver)
    if case.sensors:
        from flexgear.solve.sensors import clock_of  # slow to import

        clock = clock_of(case, pace)
        rates = {"band_hz": clock.band, "sampling_rate_hz": clock.rate}
        sections["recorder"] = {"sensors": len(case.sensors), **rates}
    return sections


def _error_cycle(motion: StageMotion) -> dict[str, Any]:
    """Gear-mesh cycles, turns and time until the errors of a stage repeat."""
    cycle = motion.cycle
    rows = {"error_cycle_gear_meshes": cycle.gear_meshes, "error_cycle_turns": float(cycle.turns)}
    if math.isfinite(motion.error_period):
        rows["error_cycle_s"] = motion.error_period
    return rows


def _rayleigh(case: Case) -> Sections:
    """Section on motions without Rayleigh damping: it is proportional to stiffness and mass of
    bodies and springs, and does not act on rotations of gears that only teeth resist."""
    if case.damping.kind != "rayleigh":
        return {}
    system = rigid_system(case)
    loose = system.rigid.shape[1] - system.rolling.shape[1]
    if not loose:
        return {}
    moves = {
        body.name: np.abs(system.rigid[system.slice_of(body.name)]).max(initial=0.0)
        for body in system.bodies
    }
    turning = [name for name, size in moves.items() if size > ROUNDING * max(moves.values())]
    ratios = {stage.name: stage.gear_mesh.damping_ratio for stage in case.stages}
    key = "gear_mesh.damping_ratio"
    acts = ", ".join(f"{name}.{key} = {ratio:g}" for name, ratio in ratios.items())
    return {
        "rayleigh_damping": {
            "rayleigh_acts_on": "deflection of bearings, supports, shafts and bodies",
            "rayleigh_leaves_undamped": f"{loose} motion{'s' * (loose > 1)} in which only teeth "
            f"hold {', '.join(turning)} against each other",
            "damping_there": f"that of the teeth alone, {acts}",
        }
    }


def _system(case: Case) -> dict[str, Any]:
    """Numbers of bodies and degrees of freedom; of a case with flexible stages only their names, as
    their assembly may take minutes."""
    if case.flexible_stages:
        return {"flexible_stages": list(case.flexible_stages)}
    system = build_system(case)
    return {
        "bodies": len(system.bodies),
        "degrees_of_freedom": system.size,
        "gear_meshes": len({(m.stage, m.kind.gear, m.side, m.planet) for m in system.gear_meshes}),
        "gyroscopic": system.gyroscopic is not None,
        "free_vibration": case.output is None,
    }


def with_reasons(sections: Sections) -> Sections:
    """Sections for printing: each figure of the solver with the reason for its default value."""
    reasons = sections.get("solver_reasons", {})
    rows = {}
    for key, value in sections.get("solver", {}).items():
        row = row_of(key, value)
        reason = next((why for name, why in reasons.items() if key.startswith(name)), "")
        rows[key] = with_unit(row.value, row.unit) + (f"   ({reason})" if reason else "")
    return {
        name: rows if name == "solver" else figures
        for name, figures in sections.items()
        if name != "solver_reasons"
    }
