"""Flank modifications: material removed from a flank as a function of profile and face.

A modification is a function of the keys of a case (``FlankModifications``) and the ``Flank``. It
returns None where these keys are absent, else a function gap(rho, z): the missing material, m,
normal to the flank in transverse section, at the radius of curvature rho of the flank (distance
from the base tangent point on the line of action) and at z along the face, of any shapes that
broadcast. To add one: write its function, enter it in ``MODIFICATIONS`` (or its shape in
``SHAPES``), and add its key to ``FlankModifications``. Modifications of a flank add up. The gap of
a pair follows from both flanks in ``profile_contact``.

Modifications of an amount C times a shape over the flank, g = C f(ξ, ζ):

    profile crowning   f = (2 ξ − 1)²    C_α at both ends of the active profile
    lead crowning      f = (2 ζ)²        C_β at both ends of the face
    profile slope      f = ξ − 1/2       C_Hα: C/2 missing at the tip, C/2 left at the root end
    helix slope        f = ζ             C_Hβ: C/2 missing at the +z end, C/2 left at the −z end
    twist              f = (ξ − 1/2) ζ   S_α: the profile slope is S ζ, the helix slope S (ξ − 1/2)

ξ and ζ as in ``Flank``. Shapes extend beyond the ends of the flank, where tips touch off the path
or a planet's flank meets its other mate. All are zero in the middle of the flank, so that none of
them alone shifts contact there. A positive helix slope removes material at larger z on every flank,
external or internal. ISO 1328-1 counts f_Hα positive where material is left at the tip:
f_Hα = −C_Hα.

Relief of tip, root and ends, at the distance x < ℓ from the edge: g = C ((ℓ − x)/ℓ)^n. x is the
distance from the tip, or from the root end of the active profile, on the path of contact; or from
an end of the face along the face. C is ``amount``, ℓ ``length`` or the distance from the edge to
the roll length of ``start_diameter``; n = 1 for the linear form, 2 for the parabolic one.

Table over profile and face: bilinear in (ρ, z), with ρ = r_b ξ at the roll angle ξ, or
√(d²/4 − r_b²) at the diameter d; constant beyond the outermost points.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy  # loads a subpackage at its first use

from flexgear.arrays import Array
from flexgear.model.modifications import FlankModifications, FlankTable, Relief
from flexgear.model.section import Refusal

Gap = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class Flank:
    """Active profile and face of a gear's flank, m. tip, root: radii of curvature ρ at the ends of
    the path of contact with the mate; ρ rises towards the tip of an external gear and falls towards
    that of a ring."""

    tip: float
    root: float
    half_face: float
    base_radius: float

    @property
    def path(self) -> float:
        """Length of the active profile on the path of contact, m."""
        return abs(self.tip - self.root)

    def height(self, rho: Array) -> Array:
        """Position ξ on the profile, linear in ρ: 0 at the root end of the active profile, 1 at the
        tip."""
        return np.asarray((rho - self.root) / (self.tip - self.root))

    def width(self, z: Array) -> Array:
        """Position ζ = z/b on the face: −1/2 at its −z end, +1/2 at its +z end."""
        return np.asarray(0.5 * z / self.half_face)

    def roll_length(self, diameter: float) -> float:
        """Radius of curvature ρ = √(d²/4 − r_b²) at a diameter, m; 0 within the base circle."""
        return math.sqrt(max(0.25 * diameter**2 - self.base_radius**2, 0.0))


SHAPES: dict[str, Callable[[Array, Array], Array]] = {  # f(ξ, ζ) by key of the case
    "profile_crowning": lambda xi, zeta: (2.0 * xi - 1.0) ** 2,
    "profile_slope": lambda xi, zeta: xi - 0.5,
    "lead_crowning": lambda xi, zeta: (2.0 * zeta) ** 2,
    "helix_slope": lambda xi, zeta: zeta,
    "twist": lambda xi, zeta: (xi - 0.5) * zeta,
}


def of_amount(name: str, modifications: FlankModifications, flank: Flank) -> Gap | None:
    """Modification C f(ξ, ζ) with the amount of key ``name``; None without an amount."""
    amount, shape = getattr(modifications, name), SHAPES[name]
    if not amount:
        return None

    def gap(rho: Array, z: Array) -> Array:
        xi, zeta = flank.height(rho), flank.width(z)
        return np.asarray(amount * shape(xi, zeta) + 0.0 * xi * zeta)

    return gap


ROUNDING = 1e-9  # relative excess of a length over its limit that is rounding
POWER = {"linear": 1, "parabolic": 2}


def end_relief(modifications: FlankModifications, flank: Flank) -> Gap | None:
    """End relief; None without its key. Raises Refusal if it is longer than the face allows."""
    relief = modifications.end_relief
    if relief is None:
        return None
    limit = flank.half_face if relief.end == "both" else 2.0 * flank.half_face
    if relief.length > limit * (1 + ROUNDING):
        limit_name = "half of the face" if relief.end == "both" else "the face"
        problem = f"{1e3 * relief.length:g} mm is longer than {limit_name}, {1e3 * limit:.4g} mm"
        raise Refusal("end_relief.length", problem, "shorten it")
    amount, length, power, end = relief.amount, relief.length, POWER[relief.form], relief.end

    def gap(rho: Array, z: Array) -> Array:
        place = {"both": np.abs(z), "+z": z, "-z": -z}[end]
        return np.asarray(amount * _rise(flank.half_face - place, length) ** power + 0.0 * rho)

    return gap


def profile_relief(name: str, modifications: FlankModifications, flank: Flank) -> Gap | None:
    """Relief "tip_relief" or "root_relief"; None without its key. Raises Refusal if it is longer
    than the path."""
    relief: Relief | None = getattr(modifications, name)
    if relief is None:
        return None
    end = flank.tip if name == "tip_relief" else flank.root
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
            problem = (
                f"{1e3 * relief.length:g} mm is longer than the path of contact, "
                f"{1e3 * flank.path:.4g} mm"
            )
            raise Refusal(f"{name}.length", problem, "shorten it")
        return relief.length
    assert relief.start_diameter is not None
    start = flank.roll_length(relief.start_diameter)
    low, high = sorted((flank.tip, flank.root))
    edge = ROUNDING * flank.path
    if not low - edge <= start <= high + edge or abs(start - end) <= edge:
        circles = sorted(2e3 * np.hypot(rho, flank.base_radius) for rho in (low, high))
        problem = (
            f"{1e3 * relief.start_diameter:g} mm is not on the active profile, "
            f"{circles[0]:.6g} … {circles[1]:.6g} mm"
        )
        raise Refusal(f"{name}.start_diameter", problem, "choose a circle between these")
    return abs(start - end)


def _rise(distance: Array, length: float) -> Array:
    """Linear rise from 0 at the distance ``length`` from an edge to 1 at and beyond the edge."""
    return np.clip(1.0 - distance / length, 0.0, 1.0)


MARGIN = 0.01  # of the active profile, or of half the face, by which rounded tables may exceed it


def table(modifications: FlankModifications, flank: Flank) -> Gap | None:
    """Modification by a table; None without one. Raises Refusal for points beyond the tip or the
    face, and for a table that misses the flank."""
    if modifications.table is None:
        return None
    rho, z = _rolls(modifications.table, flank), np.array(modifications.table.z)
    if np.abs(z).max() > (1 + MARGIN) * flank.half_face:
        raise Refusal(
            "table.z",
            f"reaches {1e3 * np.abs(z).max():g} mm, beyond the face of "
            f"±{1e3 * flank.half_face:g} mm",
            "measure z from the middle of the face, or check the unit",
        )
    gaps = np.array(modifications.table.gaps)
    nodes = [rho, z]
    for axis in (0, 1):
        if gaps.shape[axis] == 1:  # the interpolator needs two points
            gaps = np.repeat(gaps, 2, axis=axis)
            nodes[axis] = nodes[axis] + np.array([0.0, 1.0])
    interpolator = scipy.interpolate.RegularGridInterpolator(nodes, gaps)

    def gap(rho_at: Array, z_at: Array) -> Array:
        points = np.broadcast_arrays(np.clip(rho_at, rho[0], rho[-1]), np.clip(z_at, z[0], z[-1]))
        return np.asarray(interpolator(np.stack(points, axis=-1))).reshape(points[0].shape)

    return gap


def _rolls(flank_table: FlankTable, flank: Flank) -> Array:
    """Radii of curvature ρ (n,) at the points of a table on the profile, m."""
    name, places = flank_table.profile
    if name == "roll_angles":
        rho = flank.base_radius * np.array(places)
    else:
        rho = np.array([flank.roll_length(d) for d in places])
    low, high = sorted((flank.tip, flank.root))
    edge = MARGIN * flank.path
    beyond = rho.max() > high + edge if flank.tip > flank.root else rho.min() < low - edge
    if beyond or rho.max() < low or rho.min() > high or np.any(np.diff(rho) <= 0):
        factor, unit = (np.degrees(1.0), "deg") if name == "roll_angles" else (1e3, "mm")
        ends = np.array([low, high])
        angles, diameters = ends / flank.base_radius, 2.0 * np.hypot(ends, flank.base_radius)
        ends = factor * (angles if name == "roll_angles" else diameters)
        problem = (
            f"{places[0] * factor:g} … {places[-1] * factor:g} {unit} do not fit the active "
            f"profile, {ends[0]:.6g} … {ends[1]:.6g} {unit}"
        )
        raise Refusal(f"table.{name}", problem, "end at the tip, and begin outside the base circle")
    return rho


MODIFICATIONS: dict[str, Callable[[FlankModifications, Flank], Gap | None]] = {
    **{name: partial(of_amount, name) for name in SHAPES},
    **{name: partial(profile_relief, name) for name in ("tip_relief", "root_relief")},
    "end_relief": end_relief,
    "table": table,
}


def gaps_of(modifications: FlankModifications, flank: Flank) -> list[Gap]:
    """Gap functions of all modifications of one flank."""
    gaps = [modification(modifications, flank) for modification in MODIFICATIONS.values()]
    return [gap for gap in gaps if gap is not None]
