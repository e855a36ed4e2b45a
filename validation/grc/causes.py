"""Plausible causes of unequal load sharing of grc-750kw, each by itself and together.

Sizes are those of tolerance classes (ISO 1328-1 for runout, ISO 5753-1 for bearing clearance, both
from memory) or of what is known of the gearbox; none was chosen by its result.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

MOMENT = 300e3  # N m, chosen: the size that the dynamometer applied
PINS = "stages.0.errors.pin_tangential_um"
ECCENTRIC = "stages.0.errors.planet_eccentricity_um"
ECCENTRIC_AT = "stages.0.errors.planet_eccentricity_phase_deg"
SUN, RING, OFFSET, CARRIER = (
    f"stages.0.errors.{key}_um"
    for key in ("sun_eccentricity", "ring_eccentricity", "ring_offset", "carrier_eccentricity")
)
PLANET_GAP = "stages.0.planet_bearing.rollers.clearance_mm"
CARRIER_GAPS = tuple(
    f"stages.0.carrier.{name}.rollers.clearance_mm" for name in ("bearing_drive", "bearing_far")
)
SPLINE = "stages.0.sun.shaft.spline.tilt_nm_per_rad"
SPLINE_ACROSS = "stages.0.sun.shaft.spline.radial_n_per_m"
LENGTH = "stages.0.sun.shaft.sections.0.length_mm"
HOLLOW_GAP = "stages.1.gear.support.clearance_mm"
BOLTS = "stages.0.ring.fe.bolts.stiffness"


@dataclass(frozen=True)
class Cause:
    """Keys of the case that change, as files write them; linear: bearings that lose their rollers
    and clearance and are springs; why: size and where it comes from."""

    name: str
    why: str
    keys: dict[str, str] = field(default_factory=dict)
    linear: tuple[str, ...] = ()
    moment: float = MOMENT

    def __or__(self, other: Cause) -> Cause:
        """Both at once, under the first one's name."""
        return replace(
            self, keys=self.keys | other.keys, linear=(*self.linear, *other.linear)
        )  # fmt: skip


def every_cause() -> list[Cause]:
    """In the order of the table."""
    errors = [
        Cause("pin positions", "tangential ±30 µm, one pin against the others: position "
              "tolerance of a carrier's bores", {PINS: "[30, -30, -30]"}),
        Cause("planet runout", "eccentricity 20 µm, one planet against the others: half of F_r of "
              "ISO 1328 grade 6", {ECCENTRIC: "[20]", ECCENTRIC_AT: "[0, 180, 180]"}),
        Cause("sun runout", "eccentricity 20 µm: as the planets", {SUN: "20"}),
        Cause("ring runout", "eccentricity 40 µm: half of F_r of grade 7", {RING: "40"}),
        Cause("carrier runout", "pin circle 30 µm off its seats: as the pins", {CARRIER: "30"}),
        Cause("ring off the axis", "50 µm between the ring's and the carrier bearings' bores in "
              "the housing's two halves", {OFFSET: "50"}),
    ]  # fmt: skip
    held = [
        Cause("sun's spline sticks", "tilt 1e8 for 1e6 N m/rad: the upper limit of friction",
              {SPLINE: "1e8"}),
        Cause("shorter sun shaft", "500 for 800 mm; no drawing at hand", {LENGTH: "500"}),
        Cause("clearance of the hollow shaft", "0.1 mm on every side of the iss gear's bearings, "
              "whose gear mesh pushes with 180 kN", {HOLLOW_GAP: "0.1"}),
        _carrier_gap("0.3", "more than the unmounted C3 of this size (about 0.2 mm)"),
    ]  # fmt: skip
    tapered = Cause("tapered planet bearings", "preloaded: springs of the same radial stiffness, "
                    "tilt 2.2e7 N m/rad (load centres 150 mm apart)",
                    {"stages.0.planet_bearing.tilt_nm_per_rad": "2.2e7"},
                    ("planet_bearing",))  # fmt: skip
    all_tapered = replace(
        tapered, name="tapered planet and carrier bearings", why="preloaded, all of them springs"
    ) | Cause("", "", linear=("carrier.bearing_drive", "carrier.bearing_far"))
    everything = _together("all errors and all that holds the sun", [*errors, *held])
    stiff = _together("all errors, sun held, carrier bearings without clearance",
                      [*errors, *held[:2], _carrier_gap("0", "")])  # fmt: skip
    coarse = {PINS: "[60, -60, -60]", ECCENTRIC: "[40]", SUN: "40", RING: "80", CARRIER: "60",
              OFFSET: "100"}  # fmt: skip
    return [
        Cause("bundled case", "no errors"),
        Cause("a hundredth of the weight", "what gravity does",
              {"gravity_m_per_s2": "[0, -0.1, 0]"}),
        *errors,
        _planet_gap("0.022", "C2"),
        _planet_gap("0.072", "C3"),
        _carrier_gap("0", "none"),
        _carrier_gap("0.2", "the unmounted C3 of this size"),
        *held[3:],
        Cause("weight of the main shaft", "20 kN down on the carrier: half of a shaft of 4 t",
              {"loads.0.force_n": "[0, -20e3, 0]"}),
        Cause("soft ring support", "bolts at a fifth: housing's wall gives",
              {f"{BOLTS}_radial_n_per_m": "1.2e8", f"{BOLTS}_tangential_n_per_m": "1.2e8",
               f"{BOLTS}_axial_n_per_m": "2e8"}),
        Cause("soft hollow shaft bearings", "a fifth, 6e8 N/m: the housing's wall gives",
              {"stages.1.gear.support.radial_n_per_m": "6e8"}),
        *held[:3],
        replace(Cause("half the rotor moment", "150 kN m"), moment=0.5 * MOMENT),
        replace(Cause("one and a half of it", "450 kN m"), moment=1.5 * MOMENT),
        _together("all errors", errors),
        replace(_together("all that holds the sun", held), why="together: spline, shaft, "
                "clearance of the hollow shaft, of the carrier 0.3 mm"),
        everything,
        replace(everything, name="the same with the sun let go", why="its spline at 1e4 N/m across")
        | Cause("", "", {SPLINE_ACROSS: "1e4"}),
        replace(everything, name="the same at 450 kN m", moment=1.5 * MOMENT),
        stiff,
        replace(stiff, name="the same with errors twice as large", why="two grades coarser")
        | Cause("", "", coarse),
        tapered,
        all_tapered,
        replace(all_tapered, name="all tapered, all errors", why="together")
        | _together("", errors),
        replace(all_tapered, name="all tapered, all errors, sun held", why="together: spline "
                "sticks, shorter shaft")
        | _together("", [*errors, *held[:2]]),
    ]  # fmt: skip


def _planet_gap(gap: str, kind: str) -> Cause:
    return Cause(f"planet bearings {kind}", f"{gap} for 0.05 mm on every side", {PLANET_GAP: gap})


def _carrier_gap(gap: str, why: str) -> Cause:
    keys = dict.fromkeys(CARRIER_GAPS, gap)
    return Cause(f"carrier bearing clearance {gap} mm", f"for 0.1 mm on every side: {why}", keys)


def _together(name: str, causes: Iterable[Cause]) -> Cause:
    out = Cause(name, "together")
    for one in causes:
        out = out | one
    return out
