"""Modified flanks: the gap that a pair of teeth has at every place of its path of contact.

A modification is a function of what a case gives for a flank (``FlankModifications``) and of that
``Flank``, and returns gap(rho, z) -> m, the material that is missing normal to the flank in the
transverse section at the radius of curvature rho of the flank (its distance from the base tangent
point on the line of action) and at z along the face, both of any shapes that broadcast; None where
the flank has none. To add one: write its function, enter it in ``MODIFICATIONS`` (or its
shape in ``SHAPES``), and give ``FlankModifications`` its key. Modifications of a flank add up.

What gap a pair has along its path follows from both flanks: ``profile_contact``.

Modifications that are one amount C times a shape over the flank, g = C f(ξ, ζ).

    profile crowning   f = (2 ξ − 1)²    C_α at both ends of the active profile
    lead crowning      f = (2 ζ)²        C_β at both ends of the face
    profile slope      f = ξ − 1/2       C_Hα: C/2 missing at the tip, C/2 left at the root end
    helix slope        f = ζ             C_Hβ: C/2 missing at the +z end, C/2 left at the −z end
    twist              f = (ξ − 1/2) ζ   S_α: the profile slope is S ζ, the helix slope S (ξ − 1/2)

ξ and ζ as in ``Flank``. Beyond the ends, where tips touch off the path or a planet's flank meets
its other mate, shapes go on. The middle of the flank stays, so that none of them alone moves a pair
along its path there. C > 0 takes material off where z is larger on any flank of any gear, external
or internal. ISO 1328-1 counts f_Hα positive where material is left at the tip: f_Hα = −C there.

Relief of tip, root and ends: g = C ((ℓ − x)/ℓ)^n at the distance x < ℓ from where it is largest.

x: from the tip, or from the root end of the active profile, on the path of contact; or from an end
along the face. C and ℓ: ``amount`` and ``length``, or |ρ − ρ_start| with the roll length ρ_start of
``start_diameter``; n = 1 for the linear form, 2 for the parabolic one. 0 ≤ g ≤ C anywhere.

A flank as a table over profile and face: bilinear in (ρ, z) between its points.

ρ = r_b ξ at the roll angle ξ, or √(d²/4 − r_b²) at the diameter d; constant beyond the outermost
points, so min g ≤ g ≤ max g anywhere.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy  # which loads its parts as they are named

from flexgear.arrays import Array
from flexgear.model.modifications import FlankModifications, FlankTable, Relief
from flexgear.model.section import Refusal

Gap = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class Flank:
    """The active profile of a gear's flank, which is the path of contact with its mate, and its
    face; m.

    tip, root: radii of curvature ρ at its ends; half_face; base_radius. ρ rises towards the tip of
    an external gear and falls towards that of an internal one.
    """

    tip: float
    root: float
    half_face: float
    base_radius: float

    @property
    def path(self) -> float:
        """Length of the active profile on the path of contact, m."""
        return abs(self.tip - self.root)

    def height(self, rho: Array) -> Array:
        """ξ: 0 at the root end of the active profile, 1 at the tip; linear in ρ."""
        return np.asarray((rho - self.root) / (self.tip - self.root))

    def width(self, z: Array) -> Array:
        """ζ = z/b: −1/2 at the −z end of the face, +1/2 at its +z end."""
        return np.asarray(0.5 * z / self.half_face)

    def roll_length(self, diameter: float) -> float:
        """ρ = √(d²/4 − r_b²) at a diameter, m; 0 within the base circle."""
        return math.sqrt(max(0.25 * diameter**2 - self.base_radius**2, 0.0))


SHAPES: dict[str, Callable[[Array, Array], Array]] = {  # f(ξ, ζ) by key of the case
    "profile_crowning": lambda xi, zeta: (2.0 * xi - 1.0) ** 2,
    "profile_slope": lambda xi, zeta: xi - 0.5,
    "lead_crowning": lambda xi, zeta: (2.0 * zeta) ** 2,
    "helix_slope": lambda xi, zeta: zeta,
    "twist": lambda xi, zeta: (xi - 0.5) * zeta,
}


def of_amount(name: str, modifications: FlankModifications, flank: Flank) -> Gap | None:
    """Gap at rho and z (any shape), m; None without an amount of that key."""
    amount, shape = getattr(modifications, name), SHAPES[name]
    if not amount:
        return None

    def gap(rho: Array, z: Array) -> Array:
        xi, zeta = flank.height(rho), flank.width(z)
        return np.asarray(amount * shape(xi, zeta) + 0.0 * xi * zeta)

    return gap


ROUNDING = 1e-9  # relative, of what is just as long as it may be
POWER = {"linear": 1, "parabolic": 2}


def tip_relief(modifications: FlankModifications, flank: Flank) -> Gap | None:
    """Gap at rho and z (any shape), m; None without relief. Refusal of what leaves the path."""
    return _profile_relief("tip_relief", modifications.tip_relief, flank, flank.tip)


def root_relief(modifications: FlankModifications, flank: Flank) -> Gap | None:
    """Gap at rho and z (any shape), m; None without relief. Refusal of what leaves the path."""
    return _profile_relief("root_relief", modifications.root_relief, flank, flank.root)


def end_relief(modifications: FlankModifications, flank: Flank) -> Gap | None:
    """Gap at rho and z (any shape), m; None without relief. Refusal of what leaves the face."""
    relief = modifications.end_relief
    if relief is None:
        return None
    room = flank.half_face if relief.end == "both" else 2.0 * flank.half_face
    if relief.length > room * (1 + ROUNDING):
        whose = "half of the face" if relief.end == "both" else "the face"
        raise Refusal(
            "end_relief.length",
            f"{1e3 * relief.length:g} mm is longer than {whose}, {1e3 * room:.4g} mm",
            "shorten it",
        )
    amount, length, power, end = relief.amount, relief.length, POWER[relief.form], relief.end

    def gap(rho: Array, z: Array) -> Array:
        place = {"both": np.abs(z), "+z": z, "-z": -z}[end]
        return np.asarray(amount * _rise(flank.half_face - place, length) ** power + 0.0 * rho)

    return gap


def _profile_relief(name: str, relief: Relief | None, flank: Flank, end: float) -> Gap | None:
    """Relief that is largest where ρ is ``end``; one end of the active profile."""
    if relief is None:
        return None
    amount, power = relief.amount, POWER[relief.form]
    length = _length(name, relief, flank, end)

    def gap(rho: Array, z: Array) -> Array:
        from_end = (rho - end) * np.sign(0.5 * (flank.tip + flank.root) - end)
        return np.asarray(amount * _rise(from_end, length) ** power + 0.0 * z)

    return gap


def _length(name: str, relief: Relief, flank: Flank, end: float) -> float:
    """Length of relief along the path of contact, m."""
    if relief.length is not None:
        if relief.length > flank.path * (1 + ROUNDING):
            raise Refusal(
                f"{name}.length",
                f"{1e3 * relief.length:g} mm is longer than the path of contact, "
                f"{1e3 * flank.path:.4g} mm",
                "shorten it",
            )
        return relief.length
    assert relief.start_diameter is not None
    start = flank.roll_length(relief.start_diameter)
    low, high = sorted((flank.tip, flank.root))
    edge = ROUNDING * flank.path
    if not low - edge <= start <= high + edge or abs(start - end) <= edge:
        circles = sorted(2e3 * np.hypot(rho, flank.base_radius) for rho in (low, high))
        raise Refusal(
            f"{name}.start_diameter",
            f"{1e3 * relief.start_diameter:g} mm is not on the active profile, "
            f"{circles[0]:.6g} … {circles[1]:.6g} mm",
            "choose a circle between these",
        )
    return abs(start - end)


def _rise(distance: Array, length: float) -> Array:
    """1 at the end and beyond it, falling to 0 at ``length`` from it."""
    return np.clip(1.0 - distance / length, 0.0, 1.0)


BEYOND = 0.01  # of the active profile, or of half the face: what is a coarse number, not an error


def table(modifications: FlankModifications, flank: Flank) -> Gap | None:
    """Gap at rho and z (any shapes that broadcast), m; None without a table. Refusal of points
    beyond the tip or the face, and of tables that leave out the flank."""
    if modifications.table is None:
        return None
    rho, z = _rolls(modifications.table, flank), np.array(modifications.table.z)
    if np.abs(z).max() > (1 + BEYOND) * flank.half_face:
        raise Refusal(
            "table.z",
            f"reaches {1e3 * np.abs(z).max():g} mm, beyond the face of "
            f"±{1e3 * flank.half_face:g} mm",
            "count z from the middle of the face, or check the unit",
        )
    between = scipy.interpolate.RegularGridInterpolator(
        (_two(rho), _two(z)), _values(modifications.table)
    )

    def gap(rho_at: Array, z_at: Array) -> Array:
        points = np.broadcast_arrays(np.clip(rho_at, rho[0], rho[-1]), np.clip(z_at, z[0], z[-1]))
        return np.asarray(between(np.stack(points, axis=-1))).reshape(points[0].shape)

    return gap


def _rolls(flank_table: FlankTable, flank: Flank) -> Array:
    """Roll lengths of the points on the profile, m."""
    name, places = flank_table.profile
    if name == "roll_angles":
        rho = flank.base_radius * np.array(places)
    else:
        rho = np.array([flank.roll_length(d) for d in places])
    low, high = sorted((flank.tip, flank.root))
    edge = BEYOND * flank.path
    beyond = rho.max() > high + edge if flank.tip > flank.root else rho.min() < low - edge
    if beyond or rho.max() < low or rho.min() > high or np.any(np.diff(rho) <= 0):
        factor, unit = (np.degrees(1.0), "deg") if name == "roll_angles" else (1e3, "mm")
        ends = np.array([low, high])
        angles, diameters = ends / flank.base_radius, 2.0 * np.hypot(ends, flank.base_radius)
        ends = factor * (angles if name == "roll_angles" else diameters)
        raise Refusal(
            f"table.{name}",
            f"{places[0] * factor:g} … {places[-1] * factor:g} {unit} do not fit the active "
            f"profile, {ends[0]:.6g} … {ends[1]:.6g} {unit}",
            "end at the tip, and begin outside the base circle",
        )
    return rho


def _two(nodes: Array) -> Array:
    """Nodes of an interpolation, at least two."""
    return nodes if len(nodes) > 1 else np.array([nodes[0], nodes[0] + 1.0])


def _values(flank_table: FlankTable) -> Array:
    """Gaps at ``_two`` of both axes, m."""
    gaps = np.array(flank_table.gaps)
    for axis in (0, 1):
        if gaps.shape[axis] == 1:
            gaps = np.repeat(gaps, 2, axis=axis)
    return gaps


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
