"""Entry point: every error of a user or of the machine ends in one line and an exit code.

Exit codes: 0 success; 1 failed run; 2 wrong input. Only ``--debug``, for developers, shows
tracebacks.
"""

import errno
import gc
import io
import os
import signal
import stat
import sys
import time
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from types import FrameType
from typing import Any, NamedTuple, TextIO

import typer
from typer.core import TyperCommand, TyperGroup

from flexgear.cli import STOPPED, on_stop
from flexgear.model.errors import FlexgearError, FlexgearWarning, InputError, printable, shortened


class Entry(NamedTuple):
    """Module below ``flexgear.cli`` and function of a command; about: its line in ``--help``."""

    module: str
    function: str
    about: str


COMMANDS = {
    "run": Entry("run_commands", "run", "Every analysis of a case into a folder with a report."),
    "render": Entry("run_commands", "render", "Pictures and report of an earlier run again."),
    "check": Entry("case_commands", "check", "Validate a case; geometry, speeds, torques, forces."),
    "cases": Entry("case_commands", "cases", "List the bundled cases, print or copy one."),
    "schema": Entry("case_commands", "schema", "JSON schema of case files, for editors of TOML."),
    "upgrade": Entry("case_commands", "upgrade", "Rewrite a case of an earlier version."),
    "new": Entry("new_command", "new", "Propose a stage for a ratio, torque and speed."),
    "mesh": Entry("exchange_commands", "fe_meshes", "FE meshes of the bodies, to view or export."),
    "reduce": Entry("exchange_commands", "reduce", "Reduce FE bodies; error estimates."),
    "static": Entry("analysis_commands", "static", "Static equilibrium at angles."),
    "modes": Entry("analysis_commands", "modes", "Natural modes; --campbell over speed."),
    "stability": Entry("vibration_commands", "stability", "Speeds at which vibration grows."),
    "simulate": Entry("analysis_commands", "simulate", "Transient under the case's drive."),
    "orders": Entry("orders_command", "orders", "Order spectra and run-up maps of a transient."),
    "response": Entry("vibration_commands", "response", "Steady states over speed, all branches."),
    "compare": Entry("compare_command", "compare", "Variants or two runs side by side."),
    "import": Entry("exchange_commands", "import_rexs", "Make a commented case of a REXS file."),
    "export": Entry("exchange_commands", "export", "Write REXS, or reduced matrices."),
    "modify": Entry("modify_command", "modify", "Propose helix slope and crowning of the planets."),
    "sweep": Entry("sweep_command", "sweep", "Parameter study over one key or a grid of two."),
    "spectrum": Entry("spectrum_command", "spectrum", "Load bins of load cases and series."),
    "tolerance": Entry("study_commands", "tolerance", "Monte Carlo study of errors."),
    "rate": Entry("study_commands", "rate", "Safety, damage, life of gears and bearings."),
    "cache": Entry("system_commands", "cache", "Place and size of the cache; empty it."),
    "doctor": Entry("system_commands", "doctor", "What this system lacks; how to install it."),
}  # fmt: skip


# these commands solve at most one position of a train, for which compilation would take longer
UNCOMPILED = ("check", "cases", "schema", "upgrade", "new", "import", "spectrum", "orders")


def is_compiled(arguments: Sequence[str]) -> bool:
    """Whether the command of a command line needs compiled loops."""
    return next((a for a in arguments if not a.startswith("-")), "") not in UNCOMPILED


class Commands(TyperGroup):
    """The command group of ``COMMANDS``, which imports only the module of the called command."""

    def __init__(self, **attrs: Any) -> None:
        commands = {name: TyperCommand(name, help=x.about) for name, x in COMMANDS.items()}
        super().__init__(**{**attrs, "commands": commands})

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[Any, Any, list[str]]:
        """Name, command and remaining arguments of a command line."""
        name, _, rest = super().resolve_command(ctx, args)
        return name, None if name is None else loaded_command(name), rest


def loaded_command(name: str) -> Any:
    """A command with its arguments and options; imports its module."""
    entry = COMMANDS[name]
    app = typer.Typer(add_completion=False, rich_markup_mode=None)
    with without_collection():
        from flexgear.cli.options import expanded

        module = import_module(f"flexgear.cli.{entry.module}")
        gc.freeze()  # objects of modules live until the end
    app.command(name)(expanded(getattr(module, entry.function)))
    return typer.main.get_command(app)


@contextmanager
def without_collection() -> Iterator[None]:
    """Context without Python's garbage collector. Imports, and models of many components, create a
    million objects that stay alive; the search for garbage among them took a fifth to half of the
    time."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


INTERRUPTED = 130
CLOSING = 5.0  # s after Ctrl-C in which another does nothing
app = typer.Typer(
    name="flexgear",
    cls=Commands,
    help="Dynamics of planetary gear trains with flexible rings, planets, carriers and shafts.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(print_version: bool) -> None:
    if print_version:
        from flexgear.results.version import version  # slow to import

        typer.echo(f"flexgear {version()}")
        raise typer.Exit


@app.callback()
def options(
    show_version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Print the version and stop."
    ),
) -> None:
    """Dynamics of planetary gear trains with flexible rings, planets, carriers and shafts."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command line and exit with its code."""
    on_stop(_Stop())
    sys.stdout, sys.stderr = _unbroken(sys.stdout), _unbroken(sys.stderr)
    words = list(sys.argv[1:] if arguments is None else arguments)
    if not is_compiled(words):
        os.environ.setdefault("NUMBA_DISABLE_JIT", "1")  # read by ``compiled``
    if "--scheduler" not in words:
        # xarray imports dask if it is installed, which takes a second and helps only on clusters
        sys.modules.setdefault("dask", None)  # type: ignore[arg-type]
    code = run(words)
    on_stop(signal.SIG_IGN)  # a signal during the end of the interpreter
    sys.exit(code)


class _Pipe(io.FileIO):
    """A pipe that drops output after its reader has closed it, as ``head`` does; the command then
    continues."""

    def write(self, data: Any, /) -> int:
        """Write ``data`` or drop it; returns the number of bytes."""
        try:
            return super().write(data) or 0
        except BrokenPipeError:
            return len(data)


def _unbroken(stream: TextIO) -> TextIO:
    """The stream, or for a pipe one that ignores its closing by the reader."""
    try:
        number = stream.fileno()
        if not stat.S_ISFIFO(os.fstat(number).st_mode):
            return stream
    except (AttributeError, OSError, ValueError):  # closed, or without a file
        return stream
    stream.flush()
    pipe = io.BufferedWriter(_Pipe(number, "wb", closefd=False))
    return io.TextIOWrapper(pipe, stream.encoding, stream.errors, line_buffering=True)


class _Stop:
    """Handler of Ctrl-C and similar signals, which ignores repeated signals during the clean-up."""

    def __init__(self) -> None:
        self._last = -CLOSING

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Raise KeyboardInterrupt, unless the last one was less than ``CLOSING`` ago."""
        now = time.monotonic()
        if now - self._last >= CLOSING:
            self._last = now
            raise KeyboardInterrupt

    @staticmethod
    def recent() -> bool:
        """Whether a signal was raised less than ``CLOSING`` ago: calls of compiled loops make other
        errors of it, as it meets them while they pass their arguments."""
        handlers = (signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM))
        now = time.monotonic()
        return any(isinstance(h, _Stop) and now - h._last < CLOSING for h in handlers)


def run(arguments: list[str]) -> int:
    """Run a command line and print its errors to stderr; returns the exit code."""
    debug = "--debug" in arguments
    arguments = [a for a in arguments if a != "--debug"]  # allowed at any place
    if isinstance(sys.stdout, io.TextIOWrapper):  # for characters that its encoding lacks
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        with warnings.catch_warnings():
            if not debug:
                warnings.showwarning = _warn
            code = typer.main.get_command(app).main(
                args=arguments, prog_name="flexgear", standalone_mode=False
            )
    except Exception as error:
        if debug:
            raise
        return _report(error)
    except KeyboardInterrupt:
        code = INTERRUPTED
    if code == INTERRUPTED:  # typer turns Ctrl-C into this code
        return _say(STOPPED, 1)
    return code if isinstance(code, int) else 0


def _report(error: Exception) -> int:
    """Print one line about an error; returns the exit code."""
    if isinstance(error, InputError):
        return _say(str(error), 2)
    if isinstance(error, FlexgearError):
        return _say(str(error), 1)
    if isinstance(error, typer.Abort) or _Stop.recent():  # Abort: Ctrl-C in older versions of click
        return _say(STOPPED, 1)
    if hasattr(error, "format_message"):  # a wrong command line
        return _say(_command_line_fault(error), 2)
    if isinstance(error, OSError):
        name = f"{error.filename}: " if error.filename else ""
        remedy = "; free some space" if error.errno == errno.ENOSPC else ""
        return _say(f"{name}{error.strerror or error}{remedy}", 1)
    if isinstance(error, MemoryError):
        return _say("out of memory; choose --set solver.fidelity=quick or a larger machine", 1)
    kind = type(error).__name__
    return _say(f"an internal error, please report it ({kind}: {error}); --debug shows where", 1)


# problem and remedy by the type of an error of pydantic, with which typer refuses values
_VALUE_FAULTS = {
    "float_parsing": ("is not a number", "give a number, e.g. 1.5"),
    "int_parsing": ("is not a whole number", "give a whole number, e.g. 4"),
    "greater_than_equal": ("is too small", "give at least {ge}"),
}


def _command_line_fault(error: Any) -> str:
    """Message about an error of typer: option, value, problem and remedy of a refused value."""
    for fault in getattr(error.__cause__, "errors", list)()[:1]:
        if fault["type"] in _VALUE_FAULTS:
            problem, remedy = _VALUE_FAULTS[fault["type"]]
            remedy = remedy.format_map(fault.get("ctx", {}))
            return str(InputError(error.param.opts[0], str(fault["input"]), problem, remedy))
    text = shortened(error.format_message()).rstrip(".")
    text = text.replace("requires 2 arguments", "takes two numbers with a space between them")
    context = getattr(error, "ctx", None)
    return f"{text}; see {context.command_path if context else 'flexgear'} --help"


def _warn(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
    """Print a warning of flexgear in one line; warnings of libraries are for developers."""
    if issubclass(category, FlexgearWarning):
        _say(str(message), 0)


def _say(text: str, code: int) -> int:
    """Print a message to stderr in one line of printable characters; returns ``code``."""
    line = " ".join(text.split()).encode(errors="backslashreplace").decode()
    print(f"flexgear: {printable(line)}", file=sys.stderr, flush=True)
    return code
