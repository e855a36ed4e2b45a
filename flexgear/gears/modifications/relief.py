"""Relief of tip, root and ends: g = C ((ℓ − x)/ℓ)^n at the distance x < ℓ from where it is largest.

x: from the tip, or from the root end of the active profile, on the path of contact; or from an end
along the face. C and ℓ: ``amount`` and ``length``, or |ρ − ρ_start| with the roll length ρ_start of
``start_diameter``; n = 1 for the linear form, 2 for the parabolic one. 0 ≤ g ≤ C anywhere.
"""

from __future__ import annotations

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.modifications.flank import Flank, Gap
from flexgear.model.modifications import FlankModifications, Relief
from flexgear.model.section import Refusal

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
