"""Which flank of a REXS gear is the left one, and which end of its face the datum face is.

Who looks at the datum face from outside, with a tooth pointing up from its root to its tip, sees
its left flank on the left (ISO 21771, ISO 1328-1). Seen from +z a tooth of an external gear that
points up has +θ on its left; a tooth of a ring points up below the axis, and has +θ on its right:

    side of the left flank = d (external), −d (internal), d = ±1 for a datum face at the ±z end.

In an external pair left flanks touch left ones, in an internal pair too.
"""

from __future__ import annotations

from typing import Literal

Word = Literal["left", "right"]
WORDS: tuple[Word, Word] = ("left", "right")
DATUM = "datum_face_orientation"  # of a gear: on the side of its u axis, or against it
ORIENTATIONS = {"positive": 1, "negative": -1}
FACES = ("datum_face", "non_datum_face")


def tooth_side(word: Word, internal: bool, datum: int) -> int:
    """Side of the tooth of a flank, +1 towards +θ; datum: +1 for a datum face at the +z end."""
    left = -datum if internal else datum
    return left if word == "left" else -left


def word_of(side: int, internal: bool, datum: int) -> Word:
    """The flank on a side of the tooth."""
    return "left" if tooth_side("left", internal, datum) == side else "right"


def outward(datum: int, half: int) -> int:
    """End of the datum face in the axis of modifications: +z, but out from the middle in the left
    half (−1) of a double-helical stage, which is the mirror image of the right one (1)."""
    return -datum if half < 0 else datum
