"""Names of all commands and what the list of them says; the module of one is imported on its call.

Together the modules take seconds to import, as they need almost the whole package.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import Any, NamedTuple

import typer
from typer.core import TyperCommand, TyperGroup


class Home(NamedTuple):
    """Module below ``flexgear.cli`` and function of a command; about: its line in the list."""

    module: str
    function: str
    about: str


COMMANDS = {
    "run": Home("run_commands", "run", "Every analysis of a case into a folder with a report."),
    "render": Home("run_commands", "render", "Pictures and report of an earlier run again."),
    "check": Home("case_commands", "check", "Validate a case; geometry, speeds, torques, forces."),
    "cases": Home("case_commands", "cases", "List the bundled cases, print or copy one."),
    "schema": Home("case_commands", "schema", "JSON schema of case files, for editors of TOML."),
    "upgrade": Home("case_commands", "upgrade", "Write a case of an earlier version anew."),
    "new": Home("new_command", "new", "Propose a stage for a ratio, torque and speed."),
    "mesh": Home("body_commands", "mesh", "FE meshes of its bodies, to look at or export."),
    "reduce": Home("body_commands", "reduce", "Reduce FE bodies; error estimates."),
    "static": Home("analysis_commands", "static", "Static equilibrium at angles."),
    "modes": Home("analysis_commands", "modes", "Natural modes; --campbell over speed."),
    "simulate": Home("analysis_commands", "simulate", "Transient under the case's drive."),
    "compare": Home("compare_command", "compare", "Variants or two runs side by side."),
    "import": Home("exchange_commands", "import_rexs", "Make a commented case of a REXS file."),
    "export": Home("exchange_commands", "export", "Write REXS, or reduced matrices."),
    "modify": Home("modify_command", "modify", "Propose helix slope and crowning of the planets."),
    "sweep": Home("sweep_command", "sweep", "Parameter study over one key or a grid of two."),
    "tolerance": Home("tolerance_command", "tolerance", "Monte Carlo study of errors."),
    "cache": Home("cache_command", "cache", "Place and size of the cache; empty it."),
    "doctor": Home("doctor_command", "doctor", "What this system lacks, and what mends it."),
}  # fmt: skip


# they look at a train in one position at most, for which nothing is compiled
UNCOMPILED = ("check", "cases", "schema", "upgrade", "new", "import")


def is_compiled(arguments: Sequence[str]) -> bool:
    """Whether the command of a command line needs compiled loops."""
    return next((a for a in arguments if not a.startswith("-")), "") not in UNCOMPILED


class Commands(TyperGroup):
    """The table as commands that know their names and lines; the one that is called as a whole."""

    def __init__(self, **attrs: Any) -> None:
        commands = {name: TyperCommand(name, help=home.about) for name, home in COMMANDS.items()}
        super().__init__(**{**attrs, "commands": commands})

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[Any, Any, list[str]]:
        """Name, command and arguments; the module of the command is imported."""
        name, _, rest = super().resolve_command(ctx, args)
        return name, None if name is None else whole_command(name), rest


def whole_command(name: str) -> Any:
    """A command of the table with its arguments and options."""
    home = COMMANDS[name]
    app = typer.Typer(add_completion=False, rich_markup_mode=None)
    with without_collection():
        module = import_module(f"flexgear.cli.{home.module}")
        gc.freeze()  # what modules define stays until the end
    app.command(name)(getattr(module, home.function))
    return typer.main.get_command(app)


@contextmanager
def without_collection() -> Iterator[None]:
    """Switch Python's garbage collector off inside the block. Importing all modules, or a model of
    many components, makes a million objects that stay; looking through them for garbage took a
    fifth to half of the time.
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()
