"""Line loads before and after the proposed flanks, and what misaligns them before."""

from __future__ import annotations

from pathlib import Path

from rows import Picture

from face_load.runs import proposal
from face_load.statements import CASES
from flexgear.views.face_load_charts import before_and_after, contact_pattern, misalignment_chart
from flexgear.views.style import save_figure


def draw(folder: Path, fidelity: str) -> list[Picture]:
    """Three pictures a case."""
    found = []
    for case in CASES:
        before, after = proposal(case, fidelity).data
        for name, figure, title in (
            ("flanks", before_and_after(before, after), "line load before and after"),
            ("pattern", contact_pattern(before), "contact pattern"),
            ("misalignment", misalignment_chart(before), "misalignment by cause"),
        ):
            file = f"{case}_{name}.png"
            save_figure(figure, folder / file)
            found.append(Picture(file, f"{case}: {title}", "equilibria over a gear-mesh cycle"))
    return found
