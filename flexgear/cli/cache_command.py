"""The cache of reduced bodies and interrupted studies: where, how large, emptied."""

from __future__ import annotations

from typing import Annotated

import typer

from flexgear.cli.display import as_json_text, size_text, table
from flexgear.cli.options import AsJson
from flexgear.model.errors import FlexgearError
from flexgear.structures import cache as store


def cache(
    clear: Annotated[bool, typer.Option("--clear", help="Remove all of it.")] = False,
    as_json: AsJson = False,
) -> None:
    """Place, size and entries of the cache; a body that is missing there is made again."""
    place = store.cache_directory()
    try:
        entries = store.clear() if clear else store.entries()
    except OSError as error:
        text = error.strerror or error
        raise FlexgearError(f"the cache {place}: {error.filename or ''}: {text}") from error
    kinds = {
        name: [entry.size for entry in entries if entry.kind == kind]
        for kind, name in store.KINDS.items()
    }
    if as_json:
        figures = {n: {"entries": len(s), "size_bytes": sum(s)} for n, s in kinds.items()}
        size = sum(entry.size for entry in entries)
        out = {"place": str(place), "cleared": clear, "size_bytes": size, "kinds": figures}
        typer.echo(as_json_text(out))
        return
    rows = {n: f"{len(s)} in {size_text(sum(s))}" for n, s in kinds.items()}
    table(f"{'removed from' if clear else 'kept in'} {place}", rows)
    if not clear:
        typer.echo("\nFLEXGEAR_CACHE names another place; flexgear cache --clear empties it")
