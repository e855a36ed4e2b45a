"""Forces of frames that turn, in a step: they follow the speed that the train has.

Coriolis forces go with the speed, centrifugal ones with its square; both are known at rated speed.
The share of it is that of the rolling, elastic motion left out,

    s = v_rᵀ v / v_rᵀ v_r,   v_r the modal velocities at rated speed,

so s is the ratio of speeds where the train has one independent rotation, and a mean of the ratios,
weighted by inertia, where it has several. Euler forces, m ω̇ E u, are left out: against the Coriolis
forces of a motion of frequency f they are as ω̇ to 4πf ω.
"""

from __future__ import annotations

from typing import NamedTuple

from flexgear.analysis.kernels.vectors import dot
from flexgear.arrays import Array
from flexgear.compiled import FAST, INNER, njit


class FrameData(NamedTuple):
    """n modes; all empty where frames make no forces."""

    gyroscopic: Array  # (n, n) G at rated speed
    centripetal: Array  # (n, n) C at rated speed
    rated: Array  # (n,) v_r / v_rᵀ v_r


@njit(**INNER, fastmath=FAST)
def rotating_forces(h, frames, state, out):
    """G v − C q at the extrapolated motion into ``out`` (n,); the share of rated speed, 1 without
    such forces."""
    n = frames.rated.shape[0]
    velocity, acceleration = state.velocity, state.acceleration
    if n == 0:
        return 1.0
    share = dot(frames.rated, velocity) + h * dot(frames.rated, acceleration)
    for i in range(n):
        coriolis = centrifugal = 0.0
        for j in range(n):
            coriolis += frames.gyroscopic[i, j] * (velocity[j] + h * acceleration[j])
            centrifugal += frames.centripetal[i, j] * (state.eta[j] + h * velocity[j])
        out[i] = share * (coriolis - share * centrifugal)
    return share


@njit(**INNER)
def set_loads(share, histories, fixed, rows, count):
    """Forces that go with the square of speed, and those of load histories (L,) at the new time;
    the fixed elements are the last of ``count``."""
    first = count - fixed.element.shape[0]
    for e in range(fixed.element.shape[0]):
        element = fixed.element[e]
        if element.grows == 1:
            rows.parameters[first + e, 0] = share * share * fixed.parameters[e, 0]
        elif element.history >= 0:
            rows.parameters[first + e, 0] = histories[element.history]
