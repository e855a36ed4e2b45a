"""A spur pair as one degree of freedom with clearance: as a case, and as an equation of its own.

m ẍ + F = F₀,   F by the one-sided law of k δ and c δ̇, δ = x + e,
k = k̄ (1 + a cos ψ),   e = A sin(ψ + φ),   c = 2 ζ √(m k),   ψ = ωt + ψ₀.
"""

import math

import numpy as np
from contact_events import EventIntegrator
from trains import spur_pair

MASS, STIFFNESS, SHARE, ERROR, PHASE = 1.0, 4e8, 0.25, 2e-6, 0.7
TEETH, MODULE, SPEED, TORQUE = 30, 4e-3, 6000.0, 100.0
GEAR_MESH_HZ = SPEED / 60 * TEETH
RADIUS = 0.5 * TEETH * MODULE * math.cos(math.radians(20))


def case_text(damping=0.1, share=SHARE, error=ERROR, torque=TORQUE, backlash=200.0):
    """TOML text; error in m."""
    gear = 'teeth = 30, equivalent_mass_kg = 2, kinematics = "torsional"'
    return spur_pair(
        gear, gear, f"""model = "fourier"
contact_law = "one-sided"
damping_ratio = {damping}
sun_stiffness_n_per_m = 4e8
sun_harmonic_shares = [{share}]""",
        backlash=backlash, speed=SPEED, torque=torque, output='machine = { law = "torque" }',
        sections=f"""[stages.errors]
sun_gear_mesh_um = {1e6 * error}
sun_gear_mesh_phase_deg = {math.degrees(PHASE)}
[damping]
ratio = 0.0""",
    )  # fmt: skip


class DeadZone(EventIntegrator):
    """The equation of motion; first: ψ₀."""

    def __init__(self, damping, first):
        self.zeta, self.first, self.force = damping, first, TORQUE / RADIUS

    def contact(self, t, y):
        phase = self.omega * t + self.first
        k = STIFFNESS * (1 + SHARE * math.cos(phase))
        delta = y[0] + ERROR * math.sin(phase + PHASE)
        rate = y[1] + self.omega * ERROR * math.cos(phase + PHASE)
        return np.array([k * delta]), np.array([2 * self.zeta * math.sqrt(MASS * k) * rate])

    def slope(self, t, y, loads):
        return [y[1], (self.force - loads[0]) / MASS]

    def settled(self, omega, state, periods, samples):
        """x (samples,) over the last of some periods, and the state at its end."""
        self.omega, stop, x = omega, 2 * math.pi / omega, np.zeros(samples)
        times = stop * np.arange(samples) / samples
        for _ in range(periods):
            pieces = list(self.pieces(state, times, stop))
            for _, at, motion, _ in pieces:
                x[at] = motion[:, 0]
            state = pieces[-1][-1]
        return x, state
