"""Options that commands share, the case of a command, and checks of its output paths before work.

An output replaces only earlier results of the same case, or with --force any file.
"""

import functools
import inspect
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, get_type_hints

from typer import Argument, Option

from flexgear.cli.display import Report, progress
from flexgear.coupling.build import require_workable
from flexgear.files.atomic import file_target, folder_target, staged_folder, try_file
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.load import load_case
from flexgear.results.origin import Origin, is_picture, origin_of

CaseName = Annotated[
    str, Argument(metavar="CASE", help="A TOML file, or the name of a bundled case.")
]
Settings = Annotated[
    list[str] | None,
    Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change a key of the case; KEY= deletes it. Repeatable.",
    ),
]
AsJson = Annotated[bool, Option("--json", help="Print JSON, for programs.")]
Quiet = Annotated[bool, Option("--quiet", "-q", help="Show no progress, only the results.")]
Rigid = Annotated[
    list[str] | None,
    Option(metavar="PART", help="Make ring, planet, carrier, shaft or all rigid."),
]


def expanded(command: Callable[..., None]) -> Callable[..., None]:
    """The command with an argument for each field of its first argument, a dataclass of options, as
    typer needs them; a command without such an argument is returned unchanged."""
    signature = inspect.signature(command, eval_str=True)
    shared, *others = signature.parameters.values()
    group: Callable[..., Any] = shared.annotation
    if not hasattr(group, "__dataclass_fields__"):
        return command
    kinds, named = get_type_hints(group, include_extras=True), inspect.Parameter.KEYWORD_ONLY
    fields = [
        field.replace(kind=named, annotation=kinds[field.name])
        for field in inspect.signature(group).parameters.values()
    ]
    others = [other.replace(kind=named) for other in others]

    @functools.wraps(command)
    def called(**values: Any) -> None:
        command(group(**{field.name: values.pop(field.name) for field in fields}), **values)

    needed = [p for p in (*fields, *others) if p.default is p.empty]
    left = [p for p in (*others, *fields) if p.default is not p.empty]
    parameters = [*needed, *left]
    called.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    called.__annotations__ = {p.name: p.annotation for p in parameters}
    return called


def settings_of(settings: list[str] | None) -> dict[str, str]:
    """Keys and values of ``--set``."""
    overrides = {}
    for setting in settings or []:
        key, sign, value = setting.partition("=")
        if any("\ud800" <= letter <= "\udfff" for letter in setting):
            raise InputError("--set", setting, "is not UTF-8 text", "give plain text")
        if not sign or not key.strip():
            raise InputError("--set", setting, "is not KEY=VALUE", "e.g. --set stage.planets=4")
        overrides[key.strip()] = value.strip()
    return overrides


def read_case(name: str, settings: list[str] | None, *, loaded: bool = True) -> Case:
    """The case with ``--set`` applied; InputError for a case that cannot be computed.

    loaded: whether the command needs torques and refuses a case of free vibration.
    """
    case = load_case(name, settings_of(settings))
    if loaded:
        case.require_load()
    require_workable(case)
    return case


def require_flexible(case: Case, option: str = "") -> None:
    """InputError for a case that has only lumped members and so no FE mesh; option: the option that
    needs an FE mesh, for the message."""
    if not case.flexible_stages:
        problem = "has only lumped members, so nothing is flexible"
        remedy = (
            "take it out, or build a flexible stage into the train (stages.case)"
            if option
            else "name a case with a flexible stage"
        )
        raise InputError(option or case.source, case.name if option else "stages", problem, remedy)


def rigid_parts(names: list[str] | None, case: Case) -> tuple[str, ...]:
    """Components named by ``--rigid``; InputError for unknown ones."""
    from flexgear.solve.bodies import rigid_bodies

    parts = tuple(n.strip() for text in names or [] for n in text.split(","))
    rigid_bodies(case, parts)
    return tuple(dict.fromkeys(parts))


Force = Annotated[
    bool, Option("--force", help="Replace even files that are no earlier result of the same case.")
]


ForceNew = Annotated[bool, Option("--force", help="Replace an existing file.")]


def require_new(
    path: Path, option: str, force: bool, remedy: str = "choose a new name, or --force"
) -> None:
    """InputError for an output that exists, unless ``force``."""
    if file_target(path).exists() and not force:
        raise InputError(option, str(path), "is there already", remedy)


def refuse_beside(option: str, others: Mapping[str, object]) -> None:
    """InputError if other options are given that have no effect together with ``option``; others:
    whether each of them is given."""
    for other, value in others.items():
        if value:
            problem = f"has no effect beside {option}"
            raise InputError("options", other, problem, "take one of them out")


def refuse_without(option: str, others: Mapping[str, object]) -> None:
    """InputError if other options are given that have an effect only with ``option``, which is
    not; others: whether each of them is given."""
    for other, value in others.items():
        if value:
            raise InputError("options", other, f"has no effect without {option}", "leave it out")


def _folder_named(text: str) -> Path:
    if not text:
        raise InputError("--out", '""', "names no folder", "name a folder")
    return Path(text)


def _file_named(text: str) -> Path:
    if not text or text.endswith(("/", os.sep)):
        raise InputError("--out", text or '""', "names no file", "name a file")
    return Path(text)


def file_option(about: str) -> Any:
    """An option for the name of a file to write."""
    return Option(metavar="FILE", help=about, parser=_file_named)


def folder_option(about: str) -> Any:
    """An option for the name of a folder to write."""
    return Option(metavar="DIR", help=about, parser=_folder_named)


OutFolder = Annotated[Path | None, folder_option("Folder for results.")]
Interactive = Annotated[
    bool, Option(help="Plots in the report that zoom and turn, or static pictures.")
]
OutFile = Annotated[Path | None, file_option("Write the dataset (netCDF).")]


@dataclass(frozen=True, kw_only=True)
class CaseOptions:
    """Options of commands for one case, listed after those of the command itself."""

    case: CaseName
    settings: Settings = None
    force: Force = False
    as_json: AsJson = False
    quiet: Quiet = False

    def read_case(self, *, loaded: bool = True) -> Case:
        """The case with ``--set`` applied; as the function ``read_case``."""
        return read_case(self.case, self.settings, loaded=loaded)


SCHEMA = "flexgear.schema.json"
PICTURES = ("report.html", "pictures/*")
RUN = ("*.nc", "case.json", "summary.json", *PICTURES)
CHECK = ("summary.json", "flank_*.png")
TOLERANCE = (
    "tolerance.nc",
    "summary.json",
    "report.html",
    "tolerance.png",
    "face_load_factor.png",
    "largest_line_load.png",
)
RATING = (
    "rating.json",
    "rating.nc",
    "rating.csv",
    "rating.rexs",
    "report.html",
    "reserves.png",
    "damage.png",
    "duration.png",
    "ring.png",
)
_KINDS = {"run": "run", "check": "check", "tolerance": "tolerance study", "rating": "rating"}


def claim_file(path: Path | None, origin: Origin, force: bool) -> None:
    """Check, before the work, that results of a case may be written to the file ``path``, if any.

    InputError if the file is no earlier result of the case; FlexgearError if it cannot be written.
    """
    if path is None:
        return
    target = file_target(path)
    if not force and target.exists():
        _require_own([target], origin)
    try_file(target)


def claim_folder(path: Path, names: Sequence[str], origin: Origin, force: bool) -> None:
    """InputError if the folder ``path`` has files that match the patterns ``names`` and are of
    another origin. Pictures are of the same case as the results or the report beside them."""
    target = folder_target(path)
    if not force and target.is_dir():
        _require_own(_named(target, names), origin, _named(target, RUN))


def earlier(names: Sequence[str]) -> Callable[[Path], list[Path]]:
    """Function that lists the files of a folder which new results replace: files and pictures that
    match the patterns ``names`` and were written by flexgear."""
    return lambda folder: [f for f in _named(folder, names) if is_picture(f) or origin_of(f)]


def _named(folder: Path, names: Sequence[str]) -> list[Path]:
    """Files in ``folder`` that match a pattern of ``names``, without hidden ones."""
    files = (f for name in names for f in sorted(folder.glob(name)))
    return [f for f in files if not f.name.startswith(".")]


@dataclass(frozen=True)
class Study(CaseOptions):
    """Options of a study."""

    workers: Annotated[
        int | None,
        Option(min=1, metavar="N", help="Processes; chosen by the size of the study if left out."),
    ] = None
    scheduler: Annotated[
        str | None,
        Option(metavar="ADDRESS", help="A Dask cluster instead, e.g. tls://host:8786."),
    ] = None
    out: OutFolder = None
    pictures: Annotated[bool, Option(help="Draw pictures, and the report if any.")] = True

    @property
    def where(self) -> dict[str, Any]:
        """Arguments ``workers`` and ``scheduler`` of the functions of ``studies``."""
        return {"workers": self.workers, "scheduler": self.scheduler}

    @contextmanager
    def results(
        self, folder: Path, files: Sequence[str], origin: Origin
    ) -> Iterator[tuple[Path, Report]]:
        """Context with a temporary folder, whose files replace those of earlier results of the same
        case in ``folder`` (patterns ``files``), and a function that reports progress."""
        claim_folder(folder, files, origin, self.force)
        with (
            staged_folder(folder, earlier(files)) as stage,
            progress(self.quiet) as report,
        ):
            yield stage, report


def save_or_rescue(save: Callable[[Path], object], path: Path) -> None:
    """Write finished results to the file or folder ``path``; if that fails, as on a full disk, to
    the folder for temporary files, which the FlexgearError names."""
    try:
        save(path)
    except FlexgearError as error:
        if not isinstance(error.__cause__, OSError):
            raise
        rescue = Path(tempfile.mkdtemp(prefix="flexgear-"))
        try:
            save(rescue / path.name)
        except FlexgearError:
            shutil.rmtree(rescue, ignore_errors=True)
            raise error from None
        message = f"{error}; the finished work is kept as {rescue / path.name}"
        raise FlexgearError(message) from error


@contextmanager
def without_pictures(lost: list[str]) -> Iterator[None]:
    """Context in which an error of drawing is only added to ``lost``, so that results are still
    written; KeyboardInterrupt is raised as usual."""
    try:
        yield
    except Exception as error:
        text = " ".join(str(error).split())
        lost.append(text if isinstance(error, FlexgearError) else f"{type(error).__name__}: {text}")


def require_pictures(lost: Sequence[str], folder: Path) -> None:
    """FlexgearError if pictures of complete results could not be drawn."""
    if lost:
        raise FlexgearError(
            f"the pictures could not be drawn ({lost[0]}); the results are complete in {folder}: "
            f"try `flexgear render {folder}`"
        )


def _require_own(files: Iterable[Path], origin: Origin, beside: Iterable[Path] = ()) -> None:
    """InputError for a file of another case; pictures are of the case of a result beside them."""
    origins = {f: origin_of(f) for f in files}
    sources = (*origins.values(), *map(origin_of, beside))
    has_results_of_case = any(o is not None and o.same(origin) for o in sources)
    for file, owner in origins.items():
        if owner is None and is_picture(file) and has_results_of_case:
            continue
        if owner is None:
            problem = f"exists and is no result of {origin.name}"
        elif not owner.same(origin):
            problem = f"holds a {_KINDS.get(owner.result, 'result')} of {owner.name}"
        else:
            continue
        remedy = "name another place, or replace it with --force"
        raise InputError("--out", str(file), problem, remedy)


def with_schema(text: str, case: Path) -> bytes:
    """Bytes of a case file; where flexgear.schema.json (``flexgear schema --out``) is beside it,
    the first line names it for editors."""
    header = f"#:schema ./{SCHEMA}\n" if (file_target(case).parent / SCHEMA).exists() else ""
    return (header + text).encode()
