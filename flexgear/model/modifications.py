"""Modified flanks of a gear (the sections ``modifications``): what is ground off, by flank.

All amounts are normal to the flank in the transverse section and positive where material is
missing (ISO 21771); what each one takes off where is in ``gears.modifications``.
"""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from flexgear.model.flank_table import LARGEST, FlankTable
from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import Length

Form = Literal["linear", "parabolic"]


class Relief(Section):
    """Material taken off towards the tip, or towards the root.

    amount: at the end of the active profile (C_αa, C_αf); length: of the part of the path of
    contact that has relief, from that end on (L_Cαa, L_Cαf); start_diameter: the circle where it
    begins, in place of length (d_Ca, d_Cf); form: how the amount rises from there.
    """

    amount: Length = Field(gt=0.0, le=LARGEST)
    length: Length | None = Field(default=None, gt=0.0, le=1.0)
    start_diameter: Length | None = Field(default=None, gt=0.0, le=20.0)
    form: Form = "linear"

    @model_validator(mode="after")
    def _begins_once(self) -> Self:
        if self.length is None and self.start_diameter is None:
            raise Missing("length", "is missing", "add length_mm, or start_diameter_mm")
        if self.length is not None and self.start_diameter is not None:
            raise Refusal("start_diameter", "is given beside length", "keep one of them")
        return self


class EndRelief(Section):
    """Material taken off towards the ends of the face.

    amount: at the end (C_βI, C_βII); length: along the face, from the end on (L_CI, L_CII); form:
    how the amount rises; end: which of the ends, "+z", "-z", or "both".
    """

    amount: Length = Field(gt=0.0, le=LARGEST)
    length: Length = Field(gt=0.0, le=2.0)
    form: Form = "linear"
    end: Literal["both", "+z", "-z"] = "both"


class FlankModifications(Section):
    """What one flank, or both, lack: zero is an amount, too. Signed amounts leave material standing
    where they are negative.

    profile_crowning: at both ends of the active profile, as a parabola from its middle (C_α).
    profile_slope: more at the tip than at the root end of the active profile, in a straight line
    (C_Hα); the tooth's pressure angle is too large where it is positive. lead_crowning: at both
    ends of the face, as a parabola from its middle (C_β). helix_slope: more at the +z end of the
    face than at its -z end, in a straight line (C_Hβ), whatever the hand and the flank. twist: how
    much more profile_slope the +z end has than the -z end (S_α). tip_relief: towards the tip.
    root_relief: towards the root. end_relief: towards the ends of the face. table: gaps over
    profile and face, measured or computed.
    """

    profile_crowning: Length | None = Field(default=None, ge=-LARGEST, le=LARGEST)
    profile_slope: Length | None = Field(default=None, ge=-LARGEST, le=LARGEST)
    lead_crowning: Length | None = Field(default=None, ge=-LARGEST, le=LARGEST)
    helix_slope: Length | None = Field(default=None, ge=-LARGEST, le=LARGEST)
    twist: Length | None = Field(default=None, ge=-LARGEST, le=LARGEST)
    tip_relief: Relief | None = None
    root_relief: Relief | None = None
    end_relief: EndRelief | None = None
    table: FlankTable | None = None

    def of(self, flank: str) -> FlankModifications:
        """Modifications of one flank: keys of that flank first, then keys that hold for both."""
        modifications = getattr(self, flank) or FlankModifications()
        names = FlankModifications.model_fields
        fields = {name: getattr(modifications, name) for name in names}
        return FlankModifications(
            **{n: getattr(self, n) if x is None else x for n, x in fields.items()}
        )

    def key(self, flank: str, name: str) -> str:
        """Where the key ``name`` of one of its flanks stands: in its own section, or for both."""
        modifications = getattr(self, flank)
        field = name.partition(".")[0]
        return (
            f"{flank}.{name}"
            if modifications and getattr(modifications, field) is not None
            else name
        )


class GearModifications(FlankModifications):
    """Modified flanks of a gear with one gear mesh (sun, ring, pinion, gear). Keys that stand here
    are those of both flanks; a key of ``drive`` or ``coast`` replaces the same one here.

    drive: the flank that carries the rated torque. coast: the other one.
    """

    drive: FlankModifications | None = None
    coast: FlankModifications | None = None


class PlanetModifications(FlankModifications):
    """Modified flanks of the planets. Keys that stand here are those of both flanks; a key of
    ``sun`` or ``ring`` replaces the same one here.

    sun: the flank that carries the rated torque at the sun; under a torque of the other sense it
    meets the ring. ring: the flank that carries it at the ring, and meets the sun then.
    """

    sun: FlankModifications | None = None
    ring: FlankModifications | None = None
