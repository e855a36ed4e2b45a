"""Tip relief of the teeth of a gear."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from flexgear.model.section import Section
from flexgear.model.units import Length


class TipRelief(Section):
    """Material taken off both flanks towards the tip.

    amount: at the tip circle, normal to the flank in the transverse section (C_αa of ISO 21771);
    length: of the part of the path of contact that has relief, from the tip on; form: how the
    amount rises over it.
    """

    amount: Length = Field(gt=0.0, le=1e-3)
    length: Length = Field(gt=0.0, le=1.0)
    form: Literal["linear", "parabolic"] = "linear"
