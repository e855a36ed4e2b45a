"""Flanks and modifications of a REXS gear as they are called, read and written: one table
for both ways.

Who looks at the datum face from outside, with a tooth pointing up from its root to its tip, sees
its left flank on the left (ISO 21771, ISO 1328-1). Seen from +z a tooth of an external gear that
points up has +θ on its left; a tooth of a ring points up below the axis, and has +θ on its right:

    side of the left flank = d (external), −d (internal), d = ±1 for a datum face at the ±z end.

In an external pair left flanks touch left ones, in an internal pair too.

REXS leaves the signs of slopes to the standards. Here, as for a case (``gears.modifications``),

    profile_slope   C_Hα > 0: more is missing at the tip than at the root
    helix_slope     C_Hβ > 0: more is missing at the non-datum face than at the datum face
    profile_twist   S_α > 0: the profile slope is larger at the non-datum face

and amounts are those at the ends of the active profile and of the face.
"""

from __future__ import annotations

from typing import Literal

from flexgear.model.modifications import LARGEST as LARGEST_M

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


LARGEST = 1e3 * LARGEST_M  # mm, of an amount
RELIEFS = ("tip_relief", "root_relief")
CROWNINGS = {  # REXS component: key of a case, amounts at both ends
    "profile_crowning": (
        "profile_crowning_um",
        ("profile_crowning_at_tip", "profile_crowning_at_root"),
    ),
    "helix_crowning": (
        "lead_crowning_um",
        ("helix_crowning_amount_datum_face", "helix_crowning_amount_non_datum_face"),
    ),
}
SLOPES = {  # REXS component and its attribute: key of a case, whether its sign hangs on the face
    "profile_slope": ("profile_slope_um", False),
    "helix_slope": ("helix_slope_um", True),
    "profile_twist": ("twist_um", True),
}
FORMS = ("linear", "parabolic")
END_RELIEF = "end_relief"
KEYS = {  # fields of a case's ``FlankModifications`` that REXS has
    *(key.removesuffix("_um") for key, _ in (*CROWNINGS.values(), *SLOPES.values())),
    *RELIEFS,
    END_RELIEF,
}
AS_HERE = {  # what a case means anyway; other values are listed
    "shape_of_profile_crowning": ("parabolic",),
    "shape_of_helix_crowning": ("parabolic",),
    "helix_evaluation_reference": ("facewidth",),
    "is_additive_modification": ("true",),
}
LOADED = "loaded_tooth_flank"
SIGNS = {
    "profile_slope": "positive where more is missing at the tip",
    "helix_slope": "positive where more is missing at the non-datum face",
    "profile_twist": "positive where the profile slope is larger at the non-datum face",
}
