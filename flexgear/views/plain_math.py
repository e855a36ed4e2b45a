"""Mathtext of labels as the HTML that plotly knows."""

from __future__ import annotations

import re
import unicodedata


def plain_math(text: str) -> str:
    """Mathtext as the HTML that plotly knows: "$θ_c$" -> "θ<sub>c</sub>"; other text escaped."""
    escaped = text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return re.sub(r"\$([^$]*)\$", lambda m: _math(m[1]), escaped).replace("\n", "<br>")


def _math(text: str) -> str:
    text = re.sub(r"\\(?:mathrm|mathit|text)\{([^}]*)\}", r"\1", text)
    text = re.sub(r"\\([A-Za-z]+)", _greek, text)
    for sign, tag in (("_", "sub"), ("\\^", "sup")):
        text = re.sub(rf"{sign}\{{([^}}]*)\}}", rf"<{tag}>\1</{tag}>", text)
        text = re.sub(rf"{sign}(\w)", rf"<{tag}>\1</{tag}>", text)
    return text.replace("\\,", " ").replace("\\", "")


def _greek(command: re.Match[str]) -> str:
    """Letter of a command like \\gamma; any other command as it stands."""
    size = "CAPITAL" if command[1][0].isupper() else "SMALL"
    try:
        return unicodedata.lookup(f"GREEK {size} LETTER {command[1].upper()}")
    except KeyError:
        return command[0]
