"""Static load sharing of N planets from compatibility alone: no flexgear inside.

Rigid central members; each planet is one path, of ring gear mesh, planet bearing and sun gear mesh
in series. Planet equilibrium about its own axis makes both gear-mesh forces equal, F_i, and their
resultant on the planet F_i (n_s + n_r) = F_i (sin α_s − sin α_r, −cos α_s − cos α_r) in planet axes
(radial, tangential). Along both lines of action together, planet rotation cancels:

    F_i / k_i = w_i·x + e_i,
    1/k_i = 1/k_s + 1/k_r + |n_s + n_r|² cos²β_b / k_p,
    e_i   = e_s + e_r − cos β_b (n_s + n_r)·pin error,

x = plane rigid motions of the central members that may move: of the sun (x, y, θ), of ring and
carrier (x, y), in carrier axes. Equilibrium: Σ w_i F_i + K x = load. Forces, k and e (> 0: more
material) are along the three-dimensional normal; planets of helical gears do not tilt.
"""

import math
from dataclasses import dataclass

import numpy as np

ANGLE = math.radians(20)
FIXED = math.inf  # a member that cannot leave the axis; 0 is one that floats


@dataclass(frozen=True)
class Paths:
    """N planet paths: angles (N,) rad, stiffness (N,) N/m, sun's and ring's working angle rad,
    sun's base radius m, base helix angle rad."""

    angles: np.ndarray
    stiffness: np.ndarray
    sun_angle: float
    ring_angle: float
    sun_base_radius: float
    base_helix_angle: float = 0.0

    @property
    def resultant(self):
        """n_s + n_r in planet axes, times cos β_b."""
        a, b = self.sun_angle, self.ring_angle
        both = np.array([math.sin(a) - math.sin(b), -math.cos(a) - math.cos(b)])
        return math.cos(self.base_helix_angle) * both


def equal_paths(planets, *, sun_stiffness, ring_stiffness, planet_bearing=math.inf,
                sun_angle=ANGLE, ring_angle=ANGLE, sun_base_radius=0.1,
                base_helix_angle=0.0, angles=None):  # fmt: skip
    """N equal paths from gear-mesh stiffness (N/m along the normal) and planet bearing (N/m)."""
    phi = 2 * math.pi * np.arange(planets) / planets if angles is None else np.asarray(angles)
    blank = Paths(phi, np.ones(len(phi)), sun_angle, ring_angle, sun_base_radius, base_helix_angle)
    pin = blank.resultant @ blank.resultant / planet_bearing
    k = 1 / (1 / sun_stiffness + 1 / ring_stiffness + pin)
    return Paths(
        phi, np.full(len(phi), k), sun_angle, ring_angle, sun_base_radius, base_helix_angle
    )


def stage_paths(planets, helix=0.0):
    """Those of ``trains.stage_train``; helix angle, rad."""
    transverse = math.atan(math.tan(ANGLE) / math.cos(helix))
    return equal_paths(
        planets, sun_stiffness=6e8, ring_stiffness=8e8, planet_bearing=5e8,
        sun_angle=transverse, ring_angle=transverse,
        sun_base_radius=0.004 / math.cos(helix) * 26 / 2 * math.cos(transverse),
        base_helix_angle=math.asin(math.sin(helix) * math.cos(ANGLE)),
    )  # fmt: skip


def path_errors(paths, *, pin_tangential=0.0, pin_radial=0.0, sun_error=0.0, ring_error=0.0):
    """e_i (N,) in m along the normal: pins outward and in the sense of rotation, (N,) or scalar."""
    radial, tangential = paths.resultant
    zero = np.zeros(len(paths.angles))
    return zero + sun_error + ring_error - radial * pin_radial - tangential * pin_tangential


def sharing(paths, errors, sun_torque, *, sun=0.0, ring=FIXED, carrier=FIXED, one_sided=False):
    """Gear-mesh forces F (N,) in N of one side; sun_torque N·m that the planets give the sun.

    sun, ring, carrier: radial support stiffness N/m; 0 floats, FIXED stays. one_sided: planets do
    not pull. Forces are unique even where floating members leave a motion undetermined.
    """
    w, support = _freedoms(paths, sun, ring, carrier)
    load = np.zeros(len(support))
    load[0] = sun_torque / (paths.sun_base_radius * math.cos(paths.base_helix_angle))
    carrying = np.ones(len(errors), dtype=bool)
    for _ in range(4 * len(errors)):
        k = paths.stiffness * carrying
        matrix = (w.T * k) @ w + np.diag(support)
        x = np.linalg.lstsq(matrix, load - w.T @ (k * errors), rcond=1e-12)[0]
        force = paths.stiffness * (w @ x + errors)
        now = force > 0
        if not one_sided or np.array_equal(now, carrying):
            return np.where(carrying, force, 0.0)
        carrying = now
    raise AssertionError("contact of planets did not settle")


def factor(force):
    """K = N max F / Σ F."""
    return len(force) * np.max(force) / np.sum(force)


def fixed_sun(paths, errors, sun_torque):
    """The same by hand for a sun that only turns: F_i = k_i (e_i − ē + F̄ N / Σk)."""
    k = paths.stiffness
    total = sun_torque / (paths.sun_base_radius * math.cos(paths.base_helix_angle))
    return k * (errors + (total - k @ errors) / k.sum())


def _freedoms(paths, sun, ring, carrier):
    """Columns w (N, m) of rotation of the sun (as base-circle motion) and of the translations."""
    c, s = np.cos(paths.angles), np.sin(paths.angles)
    cos_b = math.cos(paths.base_helix_angle)

    def turned(n):  # planet axes to carrier axes
        return np.column_stack([c * n[0] - s * n[1], s * n[0] + c * n[1]])

    n_s = cos_b * np.array([math.sin(paths.sun_angle), -math.cos(paths.sun_angle)])
    n_r = cos_b * np.array([-math.sin(paths.ring_angle), -math.cos(paths.ring_angle)])
    columns, support = [np.ones((len(c), 1))], [0.0]
    for stiffness, normal in ((sun, n_s), (ring, n_r), (carrier, -(n_s + n_r))):
        if stiffness != FIXED:
            columns.append(turned(normal))
            support += [stiffness, stiffness]
    return np.hstack(columns), np.array(support)
