"""Every paper's rows and pictures, made once a run of the tests and kept for the common page.

What a run finds for a paper is written to `<folder>/<paper>/rows.json`, by whichever worker
computed it; the page is made from there, and says which papers an earlier run computed.
"""

import importlib
import json
import traceback
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path

from matplotlib.figure import Figure
from rows import Picture, Row

from flexgear.files.atomic import atomic_file
from flexgear.views.style import save_figure


@dataclass(frozen=True)
class Paper:
    """A package of validation/; by_fidelity: whether it takes the fidelity of FE meshes."""

    name: str
    by_fidelity: bool = False

    @property
    def title(self) -> str:
        """First sentence of the package's docstring: authors, year, DOI."""
        text = importlib.import_module(self.name).__doc__ or self.name
        return text.strip().splitlines()[0].removesuffix(".")


PAPERS = (
    Paper("iso_tr_6336_30"),
    Paper("iso_6336_6"),
    Paper("reboucas2020"),
    Paper("lin_parker1999"),
    Paper("yang2019"),
    Paper("ren2021"),
    Paper("hu2023"),
    Paper("iso_16281"),
    Paper("clearance_oscillator"),
    Paper("grc"),
    Paper("face_load", by_fidelity=True),
    Paper("solid_contact", by_fidelity=True),
    Paper("tan2023", by_fidelity=True),
)


@dataclass(frozen=True)
class Entry:
    """What is known of a paper; ``trouble``: why it could not be computed; ``made``: ISO time;
    ``run``: name of the run of the tests that computed it."""

    name: str
    title: str
    rows: tuple[Row, ...] = ()
    pictures: tuple[Picture, ...] = ()
    made: str = ""
    run: str = ""
    trouble: str = ""


@dataclass(frozen=True)
class Ledger:
    """Rows and pictures of all papers, each computed once a run of the tests."""

    folder: Path
    fidelity: str
    run: str

    def entry(self, name: str) -> Entry:
        """The paper's rows and pictures, or what went wrong, computed once a run."""
        saved = self._saved(name)
        if saved.run != self.run:
            saved = self._computed(next(p for p in PAPERS if p.name == name))
            self.save(saved)
        return saved

    def entries(self) -> list[Entry]:
        """All papers as of now, saved by this run or by an earlier one, else missing."""
        return [self._saved(p.name) for p in PAPERS]

    def _computed(self, paper: Paper) -> Entry:
        now = datetime.now().astimezone().isoformat(timespec="minutes")
        title, rows, pictures = paper.name, (), ()
        try:
            title = paper.title
            arguments = (self.fidelity,) if paper.by_fidelity else ()
            statements = importlib.import_module(f"{paper.name}.statements")
            rows = tuple(statements.rows(*arguments))
            drawing = importlib.import_module(f"{paper.name}.pictures")
            pictures = tuple(self._saved_picture(paper, *one) for one in drawing.drawn(*arguments))
        except Exception:  # the page must still be written, and says so
            trouble = traceback.format_exc(limit=-3)
        else:
            trouble = "" if rows else "no rows"
        return Entry(paper.name, title, rows, pictures, now, self.run, trouble)

    def _saved_picture(self, paper: Paper, figure: Figure, picture: Picture) -> Picture:
        file = self.folder / paper.name / picture.file
        file.parent.mkdir(parents=True, exist_ok=True)
        save_figure(figure, file, dpi=160)
        return picture

    def _file(self, name: str) -> Path:
        return self.folder / name / "rows.json"

    def save(self, entry: Entry) -> None:
        """Keep what is known of a paper for the page."""
        self._file(entry.name).parent.mkdir(parents=True, exist_ok=True)
        with atomic_file(self._file(entry.name)) as temporary:
            temporary.write_text(json.dumps(asdict(entry), indent=1), encoding="utf-8")

    def _saved(self, name: str) -> Entry:
        try:
            raw = json.loads(self._file(name).read_text("utf-8"))
            rows = tuple(Row(**row) for row in raw.pop("rows"))
            pictures = tuple(Picture(**one) for one in raw.pop("pictures"))
            return Entry(rows=rows, pictures=pictures, **raw)
        except (OSError, ValueError, TypeError, KeyError):
            return Entry(name, name, trouble="not computed yet")
