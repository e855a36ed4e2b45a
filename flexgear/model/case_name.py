"""Names of cases, which name files and folders of results, too."""

from __future__ import annotations

from flexgear.model.errors import echo
from flexgear.model.section import Refusal

_LONGEST = 100  # characters; a file name holds 255 bytes


def check_case_name(name: str) -> None:
    """Refusal of a name that can be no part of a file name, or would lead elsewhere."""
    bad = not name.isprintable() or any(sign in name for sign in '/\\:*?"<>|')
    if bad or name != name.strip(" .") or not 0 < len(name) <= _LONGEST:
        raise Refusal(
            "name",
            f"{echo(name)} cannot name a file of results",
            f'give name = "…" of letters, digits, hyphens, at most {_LONGEST} of them',
        )
