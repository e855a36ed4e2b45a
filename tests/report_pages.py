"""What every page of a report must be, whatever it tells of."""

import base64
import html
import json
import re
import zlib
from pathlib import Path

MOST = 10e6  # bytes
OF_RUNS = ("geometry", "power", "gear_meshes", "sharing", "dynamics", "modes", "accuracy", "case")
NO_FIGURE = re.compile(r"\b(nan|NaN|None|null|undefined|inf|Infinity)\b")
# but for what a reader is to write: "key k_gamma", "rating.yield_strength_mpa"
KEY = re.compile(r"(?<!\bkey )(?<!\.)\b[a-z][a-z0-9]*(?:_[a-z0-9]+)+\b")


def visible(page: str) -> str:
    """What a reader sees of a page."""
    page = re.sub(r"<(script|style|code)\b.*?</\1>", "", page, flags=re.S)
    return html.unescape(re.sub(r"<[^>]*>", " ", page))


def require_sound(path: Path, *sections: str) -> None:
    """AssertionError unless a page is whole: its sections, plots that can be read, figures in words
    and numbers, no keys of files, one file of less than 10 MB that loads nothing."""
    page = path.read_text("utf-8")
    assert path.stat().st_size < MOST
    assert page.rstrip().endswith("</html>")
    chapters = re.findall(r'<section id="(\w+)">', page)
    assert set(sections) <= set(chapters), chapters
    assert not re.search(r'(src|href)\s*=\s*"(?!data:|#)', page)
    assert "Plotly.newPlot" not in page or "showSendToCloud: false" in page  # default: an upload
    assert 'loading="lazy"' not in page  # such pictures are missing in print
    text = visible(page)
    assert not NO_FIGURE.findall(text)
    assert not KEY.findall(visible(_without_values_of_the_case(page)))
    places = set(re.findall(r'data-plot="(\w+)"', page))
    stored = re.search(r'id="plots">([^<]*)<', page)
    drawn = zlib.decompress(base64.b64decode(stored[1])) if stored else "{}"
    assert places <= set(json.loads(drawn, parse_constant=_lost))


def _without_values_of_the_case(page: str) -> str:
    """The page without what the case itself says, as names and choices stand in its file."""
    before, tag, case = page.partition('<section id="case">')
    return before + tag + re.sub(r'<td class="value[^>]*>.*?</td>', "", case, flags=re.S)


def _lost(word: str) -> None:
    raise AssertionError(f"{word} in a plot, which no browser reads")
