"""One self-contained HTML page of a run, or of two side by side: verdicts, tables, pictures.

The page loads nothing: pictures are data URIs, and it contains plotly and the data of the plots,
deflated. Static pictures are shown in print, without scripts, and in browsers that cannot inflate
data.
"""

import base64
import io
import itertools
import json
import os
import re
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import Environment
from markupsafe import Markup, escape
from matplotlib.figure import Figure
from PIL import Image

from flexgear.files.atomic import atomic_file
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError
from flexgear.results.report.parts import MARKS, SECTIONS, Row, Table, Verdict
from flexgear.results.report.tables import case_tables
from flexgear.results.report.wording import FACTOR, factor, number, scale, signed, with_unit
from flexgear.results.version import version
from flexgear.views.interactive import panels_of
from flexgear.views.style import save_figure

MEDIA = {".png": "image/webp", ".svg": "image/svg+xml", ".gif": "image/gif"}

QUALITY = 85  # of WebP pictures, in per cent: fine lines stay sharp
MAX_PLOTS = 3_000_000  # characters of the data of all plots, for a page below 10 MB
SMALLEST = 0.3  # of the size of a picture, to which it may shrink
MAX_PICTURES = 3_500_000  # characters of all pictures, for a page below 10 MB
LEAST_POINTS = 200  # of a line
DEFLATE = 5  # level: texts a hundredth larger than at 6, in half the time
TOO_LARGE = "Its plot would make this page too large, so this picture is static."
THINNED = "Lines of plots have fewer points than were computed, to keep this page small."
SMALLER = "Pictures are smaller than in the folder of the run, to keep this page small."
NO_ROOM = "It would make this page too large: see the folder of the run's pictures."


@dataclass(frozen=True)
class Picture:
    """A picture of the report. name: pictures of two runs with the same name are side by side;
    sentence: its content; plots: plotly panels that replace it on a screen."""

    name: str
    section: str
    caption: str
    sentence: str
    file: Path | None
    plots: Sequence[Mapping[str, Any]] = ()


@dataclass(frozen=True)
class Side:
    """Content of the page about one run."""

    name: str
    lead: str
    verdicts: Sequence[Verdict]
    tables: Sequence[Table]
    pictures: Sequence[Picture]
    version: str
    content_hash: str
    notes: Sequence[str] = field(default=())


def write_report(
    path: str | os.PathLike[str], title: str, case: str, sides: Sequence[Side],
    interactive: bool = True,
) -> Path:  # fmt: skip
    """Write the page atomically and return its path.

    case: name of the case in the page's metadata, by which flexgear recognises the page as a
    result of the case. sides: one run, or two side by side.
    """
    target = Path(path)
    folder = files("flexgear.views") / "templates"
    source = {
        name: (folder / f"report.{name}").read_text("utf-8") for name in ("html.j2", "css", "js")
    }
    script = plotly_script() if interactive else None
    pictures = [p for side in sides for p in side.pictures]
    plots = [plot for p in pictures for plot in p.plots] if script is not None else []
    names = {id(plot): f"plot{k}" for k, plot in enumerate(plots)}
    with ThreadPoolExecutor() as pool:  # compression releases the interpreter lock
        packed = {p.file: pool.submit(_packed, p.file) for p in pictures if p.file}
        small_script = pool.submit(deflated, script or "")
        data, left_out, thinned = within(dict(zip(names.values(), plots, strict=True)), MAX_PLOTS)
        data_of = {file: picture.result() for file, picture in packed.items()}
    media, smaller = embedded(data_of, MAX_PICTURES)

    def embed(picture: Picture | None) -> dict[str, Any] | None:
        return None if picture is None else _place(picture, names, left_out, media)

    sections = [chapter for key in SECTIONS if (chapter := _section(key, sides, embed))]
    environment = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters["typeset"] = typeset
    page = environment.from_string(source["html.j2"]).render(
        title=title,
        case=case,
        sides=sides,
        marks=MARKS,
        counts=[_counts(side) for side in sides],
        sections=sections,
        section_keys={section["key"] for section in sections},
        coarse=[text for text, applies in ((SMALLER, smaller), (THINNED, thinned)) if applies],
        style=Markup(source["css"]),
        code=Markup(source["js"]),
        plotly=small_script.result() if plots else None,
        plots=data if plots else None,
    )
    with atomic_file(target) as temporary:
        temporary.write_text(page, encoding="utf-8", errors="backslashreplace")
    return target


def saved_picture(
    figure: Figure, folder: Path, name: str, section: str, caption: str, sentence: str
) -> Picture:
    """Write a figure into a folder; returns it as a picture of the report."""
    path = save_figure(figure, folder / f"{name}.png", dpi=150)
    words = with_note(sentence, str(figure.get_suptitle()))
    return Picture(name, section, caption, words, path, panels_of(figure))


def with_note(sentence: str, note: str) -> str:
    """The sentence below a picture, with a note such as the magnification, which stands in the
    title of the drawn picture but not in the interactive plot."""
    return f"{sentence} {note[:1].upper()}{note[1:]}.".replace("\n", "; ") if note else sentence


def write_study(
    folder: Path, case: Case, study: str, lead: str, pictures: Sequence[Picture],
    verdicts: Sequence[Verdict] = (), tables: Sequence[Table] = (),
) -> Path:  # fmt: skip
    """Write the page of a study of one case into a folder; tables: followed by those of the case,
    if there are any."""
    name, all_tables = case.title or case.name, [*tables, *case_tables(case)] if tables else ()
    side = Side(name, lead, verdicts, all_tables, pictures, version(), case.content_hash())
    return write_report(folder / "report.html", f"{case.name}: {study}", case.name, [side])


def typeset(text: str) -> Markup:
    """Escaped text with subscripts of symbols of one letter, "K_Hβ" -> K<sub>Hβ</sub>, and no break
    between a number and its unit. Keys remain: "key k_v"."""
    unbroken = re.sub(r"(?<=\d) (?=[%°×µA-Za-z])", "\u00a0", str(escape(text)))
    unbroken = re.sub(r"(\u00a0[kM]?N) m\b", "\\1\u00a0m", unbroken)
    symbol = r"(?<!key )(?<![\w.])([^\W\d_])_([^\W_]+(?:\.\d+)?)(?!\w)"
    return Markup(re.sub(symbol, r"\1<sub>\2</sub>", unbroken))


def plotly_script() -> str | None:
    """The text of plotly.js; None if plotly is not installed, so that pictures are static."""
    try:
        import plotly
    except ModuleNotFoundError:
        return None
    return (files(plotly) / "package_data" / "plotly.min.js").read_text("utf-8")


def deflated(text: str) -> str:
    """Base64 text of the zlib stream of a text."""
    return base64.b64encode(zlib.compress(text.encode(), DEFLATE)).decode("ascii")


def embedded(pictures: Mapping[Path, bytes], limit: int) -> tuple[dict[Path, str], bool]:
    """Pictures as data URIs, and whether they were shrunk.

    They are shrunk until they take at most ``limit`` characters; the largest are omitted if that is
    not enough.
    """
    data, shrink = dict(pictures), 1.0
    while sum(map(len, data.values())) * 4 / 3 > limit and shrink > SMALLEST:
        shrink *= 0.75
        data = {file: _packed(file, shrink) for file in pictures}
    while sum(map(len, data.values())) * 4 / 3 > limit:
        del data[max(data, key=lambda file: len(data[file]))]
    texts = {
        file: f"data:{MEDIA[file.suffix.lower()]};base64,{base64.b64encode(raw).decode('ascii')}"
        for file, raw in data.items()
    }
    return texts, shrink < 1.0


def _packed(path: Path, shrink: float = 1.0) -> bytes:
    """Bytes of a picture for the page; PNG as WebP, which takes a third of the size for charts."""
    if path.suffix.lower() not in MEDIA:
        raise FlexgearError(f"cannot put {path} into the report: only {', '.join(MEDIA)}")
    try:
        data = path.read_bytes()
        if path.suffix.lower() != ".png":
            return data
        with Image.open(io.BytesIO(data)) as picture:
            small = picture.convert("RGB")
    except OSError as error:
        raise FlexgearError(f"cannot read picture {path}: {error.strerror or error}") from error
    if shrink < 1.0:
        width, height = (max(1, round(shrink * n)) for n in small.size)
        small = small.resize((width, height), Image.Resampling.LANCZOS)
    out = io.BytesIO()
    small.save(out, format="WEBP", quality=QUALITY, method=2)
    return out.getvalue()


def within(plots: Mapping[str, Any], limit: int) -> tuple[str, set[str], bool]:
    """Deflated data of plots, names of omitted plots, and whether lines were thinned.

    Every second point of lines is removed until all plots take at most ``limit`` characters; if
    that is not enough, the largest plots are omitted.
    """
    left, text, thin = dict(plots), deflated(json.dumps(plots)), False
    while len(text) > limit:
        thinned = _halved(left)
        if thinned == left:
            del thinned[max(left, key=lambda name: len(deflated(json.dumps(left[name]))))]
        else:
            thin = True
        left, text = thinned, deflated(json.dumps(thinned))
    return text, set(plots) - set(left), thin


def _halved(value: Any) -> Any:
    """Plots with every second point of their long lines, and all gaps between their pieces."""
    if isinstance(value, Mapping):
        halve = value.get("type") == "scatter" and len(value.get("x", ())) > LEAST_POINTS
        left = [not halve or k % 2 == 0 or y is None for k, y in enumerate(value.get("y", ()))]
        return {
            k: list(itertools.compress(v, left))
            if halve and k in ("x", "y", "customdata")
            else _halved(v)
            for k, v in value.items()
        }
    if isinstance(value, list) and value and isinstance(value[0], Mapping):
        return [_halved(v) for v in value]
    return value


def side_by_side(sides: Sequence[Side], section: str) -> list[dict[str, Any]]:
    """Tables of a section: title, whether it is folded, and rows with label, figures of all sides
    and difference."""
    table_rows: dict[str, dict[str, list[Row | None]]] = {}
    windows: dict[str, dict[str, str]] = {}  # by title and letter of the side
    folded = {table.title for side in sides for table in side.tables if table.folded}
    for k, side in enumerate(sides):
        for table in side.tables:
            if table.section == section:
                windows.setdefault(table.title, {})["AB"[k]] = table.window
                rows = table_rows.setdefault(table.title, {})
                for row in table.rows:
                    rows.setdefault(row.label, [None] * len(sides))[k] = row
    return [
        {
            "title": ", ".join([title, *_windows(windows[title])]),
            "folded": title in folded,
            "rows": [(label, *_cells(cells)) for label, cells in rows.items()],
        }
        for title, rows in table_rows.items()
    ]


def _windows(by_side: Mapping[str, str]) -> list[str]:
    """Time windows of a table that two runs have: once where both have the same one, otherwise each
    with the letter of its run, such as "from 1 to 2 s (A)"."""
    distinct = set(by_side.values())
    if len(distinct) == 1:
        return [window for window in distinct if window]
    return [f"{window} ({side})" for side, window in by_side.items() if window]


LEAST_CHANGE = 0.005  # %, below which a difference is printed as none


def _cells(rows: Sequence[Row | None]) -> tuple[list[str], str]:
    """Figures of a row in one unit, and the relative difference of the second from the first, or
    "≠" of words that differ."""
    values = [row.value if row else None for row in rows]
    unit = next((row.unit for row in rows if row), "")
    numbers = [float(v) for v in values if isinstance(v, int | float) and not isinstance(v, bool)]
    if len(numbers) < 2 or len(numbers) < len(values):
        texts = [with_unit(v, unit) for v in values]
        return texts, "≠" if None not in values and len(set(texts)) > 1 else ""
    printed, by = scale(numbers, unit)
    texts = [f"{number(v * by)} {printed}".rstrip() for v in numbers]
    texts = texts if unit != FACTOR else [factor(v) for v in numbers]
    first, second = numbers
    change = 100 * (second - first) / abs(first) if first else float("inf")
    zeros = not any(text.partition(" ")[0].strip("−0.") for text in texts)
    if zeros or first == second or abs(change) < LEAST_CHANGE:
        return texts, "="
    return texts, f"{signed(change, 2)} %" if abs(change) < 1e4 else "–"


def _section(
    key: str, sides: Sequence[Side], embed: Callable[[Picture | None], dict[str, Any] | None]
) -> dict[str, Any] | None:
    """A section of the page with tables and pictures; None without any. embed: function that
    returns a picture of one side as the template needs it."""
    tables = side_by_side(sides, key)
    pictures = []
    for of_sides in _by_name(sides, key):
        first = next(p for p in of_sides if p is not None)
        words = {"caption": first.caption, "sentence": first.sentence}
        pictures.append(words | {"places": list(map(embed, of_sides))})
    if not tables and not pictures:
        return None
    heading, about = SECTIONS[key]
    return {"key": key, "heading": heading, "about": about, "tables": tables, "pictures": pictures}


def _by_name(sides: Sequence[Side], section: str) -> Iterator[list[Picture | None]]:
    """Pictures of a section by name, one of each side or None."""
    by_side = [{p.name: p for p in side.pictures if p.section == section} for side in sides]
    for name in dict.fromkeys(name for pictures in by_side for name in pictures):
        yield [pictures.get(name) for pictures in by_side]


def _place(
    picture: Picture, names: Mapping[int, str], left_out: set[str], media: Mapping[Path, str]
) -> dict[str, Any]:
    """A picture for the template, static if its plots are omitted. names: of plots by their id."""
    plots = [names[id(plot)] for plot in picture.plots if id(plot) in names]
    image, note = media.get(picture.file) if picture.file else None, ""
    if left_out.intersection(plots):
        plots, note = [], TOO_LARGE
    elif picture.file and image is None and not plots:
        note = NO_ROOM
    tall = any("scene" in p.get("layout", {}) for p in picture.plots)
    return {"plots": plots, "image": image, "note": note, "shape": "tall" if tall else ""}


def _counts(side: Side) -> list[tuple[str, int, str]]:
    """Level, number and word of the verdicts of each level."""
    levels = [v.level for v in side.verdicts]
    return [(m, levels.count(m), text) for m, text in MARKS.items() if m in levels]  # type: ignore[arg-type]
