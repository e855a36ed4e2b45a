"""Line loads before and after the proposed flanks, and what misaligns them before."""

from collections.abc import Iterator

from rows import Drawn, Picture

from face_load.runs import proposal
from face_load.statements import CASES
from flexgear.views.face_load_charts import before_and_after, contact_pattern, misalignment_chart


def drawn(fidelity: str) -> Iterator[Drawn]:
    """Three pictures a case."""
    for case in CASES:
        before, after = proposal(case, fidelity).data
        for name, figure, title in (
            ("flanks", before_and_after(before, after), "line load before and after"),
            ("pattern", contact_pattern(before), "contact pattern"),
            ("misalignment", misalignment_chart(before), "misalignment by cause"),
        ):
            note = "equilibria over a gear-mesh cycle"
            yield figure, Picture(f"{case}_{name}.png", f"{case}: {title}", note)
