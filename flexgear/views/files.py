"""Files appear whole or not at all."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from flexgear.model.errors import FlexgearError


@contextmanager
def atomic_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary name beside ``path``; rename it onto ``path`` when the block succeeds.

    Whatever goes wrong inside (full disk, Ctrl-C, a bug) the temporary file is removed and an
    older ``path`` stays as it was. Operating-system errors become a one-line `FlexgearError`.
    """
    target = Path(path)
    temporary = target.with_name(f".{target.stem}.{secrets.token_hex(4)}{target.suffix}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        os.replace(temporary, target)
    except OSError as error:
        reason = error.strerror or str(error)
        raise FlexgearError(f"cannot write {target}: {reason}") from error
    finally:
        with suppress(OSError):  # the folder itself could not be made
            temporary.unlink(missing_ok=True)
