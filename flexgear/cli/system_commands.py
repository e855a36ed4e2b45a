"""Commands about this machine: ``flexgear cache`` and ``flexgear doctor``."""

import ctypes
import importlib.metadata
import os
import platform
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import typer
from typer import Option

from flexgear.cli import options
from flexgear.cli.display import as_json_text, table
from flexgear.files.cache_folder import cache_directory
from flexgear.model.errors import FlexgearError
from flexgear.model.units import size_text
from flexgear.results.version import version
from flexgear.structures import cache as store
from flexgear.studies.early_workers import processors

LIBRARIES = {  # of gmsh and VTK on Linux, with their packages in Debian and Ubuntu
    "libGL.so.1": "libgl1", "libEGL.so.1": "libegl1", "libGLU.so.1": "libglu1-mesa",
    "libXcursor.so.1": "libxcursor1", "libXft.so.2": "libxft2",
    "libXinerama.so.1": "libxinerama1", "libXrender.so.1": "libxrender1",
    "libXfixes.so.3": "libxfixes3", "libfontconfig.so.1": "libfontconfig1",
    "libgomp.so.1": "libgomp1",
}  # fmt: skip
LEAST_FREE = 1 << 30  # bytes, for some reduced bodies and the results of a run


@dataclass(frozen=True)
class Finding:
    """Result of one check. mend: command or advice against the problem, "" without a problem."""

    what: str
    found: str
    mend: str = ""


def doctor(as_json: options.AsJson = False) -> None:
    """Check libraries, packages, threads, cache and disk, and name a remedy for each problem.

    Exit code 1 if there is a problem.
    """
    findings = list(look())
    wrong = [finding for finding in findings if finding.mend]
    if as_json:
        content = {"healthy": not wrong, "findings": [asdict(finding) for finding in findings]}
        typer.echo(as_json_text(content))
    else:
        width = max(len(finding.what) for finding in findings)
        for finding in findings:
            typer.echo(f"{'!!' if finding.mend else 'ok'}  {finding.what:{width}}  {finding.found}")
        for finding in wrong:
            typer.echo(f"\n{finding.what}: {finding.mend}")
    if wrong:
        raise typer.Exit(1)


def look() -> Iterator[Finding]:
    """Results of all checks, in the order of the printout."""
    yield Finding("flexgear", f"{version()}, Python {platform.python_version()}")
    yield from _packages()
    if sys.platform.startswith("linux"):
        yield _libraries()
    yield _rendering()
    yield _threads()
    yield from _places()


def _packages() -> Iterator[Finding]:
    """Required packages that are missing or too old, or the versions of all."""
    try:
        requirements = importlib.metadata.requires("flexgear") or []
    except importlib.metadata.PackageNotFoundError:
        yield Finding("packages", "flexgear is not installed", "python -m pip install .")
        return
    versions, wrong = [], []
    for line in requirements:
        if ";" in line:
            continue  # belongs to an extra
        match = re.match(r"([\w.-]+).*?>=\s*([\d.]+)", line)
        name, least = match.groups() if match else (line, "0")
        try:
            has = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            wrong.append(f"{name} is missing")
            continue
        versions.append(f"{name} {has}")
        if _numbers(has) < _numbers(least):
            wrong.append(f"{name} {has} is older than {least}")
    mend = f"{sys.executable} -m pip install --upgrade flexgear" if wrong else ""
    yield Finding("packages", "; ".join(wrong) or ", ".join(versions), mend)


def _numbers(text: str) -> list[int]:
    return [int(part) for part in re.findall(r"\d+", text)[:3]]


def _libraries() -> Finding:
    missing = {name: package for name, package in LIBRARIES.items() if not _loads(name)}
    if not missing:
        return Finding("system libraries", f"all {len(LIBRARIES)} present")
    from flexgear.views.render import apt_line

    return Finding(
        "system libraries", f"{', '.join(missing)} missing", apt_line(" ".join(missing.values()))
    )


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _rendering() -> Finding:
    """Whether 3D pictures can be rendered without a display."""
    from flexgear.views.render import apt_line, require_rendering

    try:
        require_rendering()
    except FlexgearError as fault:
        return Finding("rendering", str(fault), apt_line())
    return Finding("rendering", "works without a display")


def _threads() -> Finding:
    """Number of usable processors, and settings that limit threads."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
    settings = ", ".join(f"{name}={os.environ[name]}" for name in names if name in os.environ)
    return Finding("threads", f"{processors()} processors{'; ' + settings if settings else ''}")


def _places() -> Iterator[Finding]:
    """Whether cache and working folder are writable and have free space."""
    cache = cache_directory()
    for what, path, mend in (
        ("cache", cache, "export FLEXGEAR_CACHE=/a/folder/that/you/may/write"),
        ("results", Path.cwd(), "work in a folder that you may write"),
    ):
        folder = next(p for p in (path, *path.absolute().parents) if p.exists())
        free = shutil.disk_usage(folder).free
        if not _writable(folder):
            yield Finding(what, f"{path} cannot be written", mend)
        elif free < LEAST_FREE:
            mend = "flexgear cache --clear, or make room"
            yield Finding(what, f"{path}: only {size_text(free)} free", mend)
        else:
            yield Finding(what, f"{path}: {size_text(free)} free")


def _writable(folder: Path) -> bool:
    try:
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def cache(
    clear: Annotated[bool, Option("--clear", help="Remove all of it.")] = False,
    as_json: options.AsJson = False,
) -> None:
    """Place, size and entries of the cache; missing bodies are reduced again when needed."""
    folder = store.cache_directory()
    try:
        entries = store.clear() if clear else store.entries()
    except OSError as error:
        text = error.strerror or error
        raise FlexgearError(f"the cache {folder}: {error.filename or ''}: {text}") from error
    kinds = {
        name: [entry.size for entry in entries if entry.kind == kind]
        for kind, name in store.KINDS.items()
    }
    if as_json:
        figures = {n: {"entries": len(s), "size_bytes": sum(s)} for n, s in kinds.items()}
        size = sum(entry.size for entry in entries)
        out = {"place": str(folder), "cleared": clear, "size_bytes": size, "kinds": figures}
        typer.echo(as_json_text(out))
        return
    rows = {n: f"{len(s)} in {size_text(sum(s))}" for n, s in kinds.items()}
    table(f"{'removed from' if clear else 'kept in'} {folder}", rows)
    if not clear:
        typer.echo("\nFLEXGEAR_CACHE names another place; flexgear cache --clear empties it")
