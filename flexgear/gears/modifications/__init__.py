"""Modified flanks: the gap that a pair of teeth has at every place of its path of contact.

A modification is a function of what a case gives for a flank (``FlankModifications``) and of that
``Flank``, and returns gap(rho, z) -> m, the material that is missing normal to the flank in the
transverse section at the radius of curvature rho of the flank (its distance from the base tangent
point on the line of action) and at z along the face, both of any shapes that broadcast; None where
the flank has none. To add one: write its file, enter it in ``MODIFICATIONS`` (or its shape in
``amounts``), and give ``FlankModifications`` its key. Modifications of a flank add up.

What gap a pair has along its path follows from both flanks: ``profile_contact``.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from flexgear.gears.modifications.amounts import SHAPES, of_amount
from flexgear.gears.modifications.flank import Flank, Gap
from flexgear.gears.modifications.relief import end_relief, root_relief, tip_relief
from flexgear.gears.modifications.table import table
from flexgear.model.modifications import FlankModifications

__all__ = ["MODIFICATIONS", "Flank", "Gap", "gaps_of"]

MODIFICATIONS: dict[str, Callable[[FlankModifications, Flank], Gap | None]] = {
    **{name: partial(of_amount, name) for name in SHAPES},
    "tip_relief": tip_relief,
    "root_relief": root_relief,
    "end_relief": end_relief,
    "table": table,
}


def gaps_of(of_flank: FlankModifications, flank: Flank) -> list[Gap]:
    """All modifications of one flank of a gear."""
    gaps = [gap_of(of_flank, flank) for gap_of in MODIFICATIONS.values()]
    return [gap for gap in gaps if gap is not None]
