"""The root that a tool leaves: its outline is put in many positions, the innermost points remain.

Nothing is known here of where a point of the tool cuts. Half of the tool's tooth is a chain of
points v + iu in its own frame, from the middle of its tip over the rounding and up the flank that
makes the finished gear: u across, v towards its tip, from the rolling line of a rack, from the
centre of a cutter. The rounding is put into its corner by solving for its centre. At every radius
the gear's space is as wide as the widest of all positions makes it.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from cut_teeth.gear import Gear, working
from flexgear.arrays import Array

Points = NDArray[np.complex128]
ON_TOOL = 900  # points of the rounding, and of each flank
POSITIONS = 3000
TRAVEL = 3.0  # normal modules on either side along the rolling line, at least
RADII = 400
TOUCHES = 1e-5  # over the module, within which root and involute are one line


@dataclass(frozen=True)
class Tool:
    """outline: half of its tooth in the transverse section, m; radius: of its rolling circle, m
    (infinite: a rack); gear_radius: of the gear's; distance: between the axes, m; land: angle on
    the gear that half of the tip land takes, rad; flank_end: roll length on the gear that the
    tool's flank reaches, m."""

    outline: Points
    radius: float
    gear_radius: float
    distance: float
    land: float
    flank_end: float


def tool_of(gear: Gear) -> Tool:
    """Rack or cutter of a gear."""
    return cutter(gear) if gear.cutter_teeth else rack(gear)


def rack(gear: Gear) -> Tool:
    """In the normal section, stretched by 1/cos β across."""
    m, rho, tan = gear.module, gear.rounding * gear.module, math.tan(gear.alpha)
    tip = (gear.dedendum - gear.shift) * m
    half = math.pi * m / 4 - gear.shift * m * tan
    rest = gear.protuberance - gear.allowance
    corner = half + rest / math.cos(gear.alpha) - tip * tan  # of tip line and flank, u
    # a circle in a corner of 90° + α touches both sides at ρ tan(45° − α/2) from it
    centre = (tip - rho) + 1j * (corner - rho * math.tan(math.pi / 4 - gear.alpha / 2))
    last = gear.ramp if rest > 0 else gear.alpha
    turn = np.linspace(0.0, math.pi / 2 - last, ON_TOOL)
    bend = centre + rho * np.exp(1j * turn)
    chain = [np.array([tip + 0j]), bend]
    start = bend[-1]
    if rest > 0:
        free = start.imag - (half - start.real * tan)
        up = free / (tan - math.tan(last))
        chain.append(start + np.linspace(0, up, ON_TOOL)[1:] * (1j * math.tan(last) - 1))
        start = chain[-1][-1]
    chain.append(start + np.linspace(0, 4 * m, ON_TOOL)[1:] * (1j * tan - 1))
    line = np.concatenate(chain)
    outline = line.real + 1j * line.imag / math.cos(gear.helix)
    sine = math.sin(gear.transverse)
    end = gear.reference_radius * sine - (tip - rho * (1 - math.sin(gear.alpha))) / sine
    r = gear.reference_radius
    return Tool(outline, math.inf, r, 0.0, outline[1].imag / r, end)


def cutter(gear: Gear) -> Tool:
    """Shaper cutter in the transverse section; its tip circle reaches the gear's root circle."""
    m, out, rho = gear.module, gear.outward, gear.rounding * gear.module
    tool = Gear(gear.cutter_teeth, m, False, gear.cutter_shift, gear.alpha, gear.helix)
    distance, angle = working(tool, gear)
    tip = out * (distance - gear.root_radius)
    rest = (gear.protuberance - gear.allowance) / math.cos(gear.helix)
    base = tool.base_radius

    def flank(t: Array, inward: float = 0.0) -> Points:
        """+u flank where a string of t base radii is unrolled, or so much inside of it."""
        radius = base * np.hypot(1.0, t)
        angle = tool.half_angle(radius)
        point = radius * np.exp(1j * angle)
        # the string leaves the base circle arctan t further on, and is the flank's normal
        normal = np.exp(1j * (angle + math.pi / 2 - np.arctan(t)))
        return np.asarray(point - inward * normal)

    at = brentq(lambda t: abs(flank(t, rho - rest)) - (tip - rho), 1e-3, 1.5, xtol=1e-15)
    centre, start = complex(flank(at, rho - rest)), float(np.angle(flank(at, rho - rest)))
    normal = complex(flank(at)) - complex(flank(at, 1.0))
    last = math.pi / 2 - gear.ramp if rest > 0 else float(np.angle(normal))
    bend = centre + rho * np.exp(1j * np.linspace(start, last, ON_TOOL))
    chain = [np.array([tip + 0j]), tip * np.exp(1j * np.linspace(0, start, 50)), bend]
    t_end = at
    if rest > 0:
        along = 1j * np.exp(1j * last)

        def free(length: float) -> float:
            point = complex(bend[-1]) + length * along
            return float(np.angle(point) - tool.half_angle(abs(point)))

        up = brentq(free, 0.0, 2 * m, xtol=1e-15)
        chain.append(bend[-1] + np.linspace(0, up, ON_TOOL)[1:] * along)
        t_end = math.sqrt((abs(chain[-1][-1]) / base) ** 2 - 1)
    chain.append(flank(np.linspace(t_end, 0.0, ON_TOOL))[1:])
    end = distance * math.sin(angle) - out * base * at
    return Tool(
        np.concatenate(chain),
        base / math.cos(angle),
        gear.base_radius / math.cos(angle),
        distance,
        start * tool.teeth / gear.teeth,
        end,
    )


def positions(gear: Gear, tool: Tool) -> Iterator[Points]:
    """Outlines in the frame of the gear: the middle of the space on the real axis, the outline's
    side towards +θ."""
    alpha = math.acos(gear.base_radius / tool.gear_radius)
    at_tip = abs(gear.roll_length(gear.tip_radius) - gear.base_radius * math.tan(alpha))
    travel = max(TRAVEL * gear.module, 1.1 * at_tip / math.cos(alpha) + gear.pitch / 2)
    for moved in np.linspace(-travel, travel, POSITIONS):
        if math.isinf(tool.radius):
            placed = tool.gear_radius - np.conj(tool.outline) + 1j * moved
        elif gear.internal:
            placed = tool.distance + tool.outline * np.exp(1j * moved / tool.radius)
        else:
            placed = tool.distance - np.conj(tool.outline * np.exp(1j * moved / tool.radius))
        yield placed * np.exp(-1j * moved / tool.gear_radius)


def half_angles(gear: Gear, radii: Array) -> Array:
    """Half angle of the gear's tooth that the tool leaves at rising radii (n,), rad."""
    space = np.full(len(radii), -np.inf)
    for line in positions(gear, tool_of(gear)):
        radius, angle = abs(line), np.angle(line)
        rises = np.sign(np.diff(radius))
        turns = np.flatnonzero(np.diff(rises)) + 1
        for start, stop in pairwise([0, *turns, len(line) - 1]):
            run = slice(start, stop + 1)
            order = 1 if rises[start] > 0 else -1
            r, a = radius[run][::order], angle[run][::order]
            crossing = np.interp(radii, r, a, left=-np.inf, right=-np.inf)
            np.maximum(space, crossing, out=space)
    return gear.pitch_angle / 2 - space


def side(gear: Gear, count: int = RADII) -> Points:
    """(count + 1,) points of the +y side of a tooth on the x axis from the tip circle to the root
    circle, denser towards that."""
    span = gear.tip_radius - gear.root_radius
    radii = gear.root_radius + span * np.linspace(1.0, 0.0, count + 1)[:-1] ** 2
    order = np.argsort(radii)
    half = np.empty(count)
    half[order] = half_angles(gear, radii[order])
    tool = tool_of(gear)
    end = gear.root_radius * np.exp(1j * (gear.pitch_angle / 2 - tool.land))
    return np.append(radii * np.exp(1j * half), end)


def root(gear: Gear, count: int) -> Points:
    """(count + 1,) points of the +y side at equal steps of arc length, from where the involute
    begins to the root circle."""
    line = side(gear)
    off = gear.base_radius * (np.angle(line) - gear.half_angle(abs(line)))
    start = max(int(np.argmax(abs(off) > TOUCHES * gear.module)) - 1, 0)
    return resampled(line[start:], count)


def resampled(line: Points, count: int) -> Points:
    """(count + 1,) points at equal steps along a chain."""
    along = np.concatenate([[0.0], np.cumsum(abs(np.diff(line)))])
    at = np.linspace(0.0, along[-1], count + 1)
    return np.interp(at, along, line.real) + 1j * np.interp(at, along, line.imag)
