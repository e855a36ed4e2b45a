"""A spur pair as one degree of freedom with clearance: as a case, and as an equation of its own.

m ẍ + F = F₀,   F by the one-sided law of k δ and c ẋ, δ = x + e,
k = k̄ (1 + a cos ψ),   e = A sin(ψ + φ),   c = 2 ζ √(m k),   ψ = ωt + ψ₀.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp
from trains import spur_pair

MASS, STIFFNESS, SHARE, ERROR, PHASE = 1.0, 4e8, 0.25, 2e-6, 0.7
TEETH, MODULE, SPEED = 30, 4e-3, 6000.0
GEAR_MESH_HZ = SPEED / 60 * TEETH
RADIUS = 0.5 * TEETH * MODULE * math.cos(math.radians(20))


def case_text(damping=0.1, torque=100.0, backlash=200.0, share=SHARE, error=ERROR):
    """TOML text; µm, N·m."""
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


class DeadZone:
    """The equation of motion, integrated from contact event to contact event."""

    def __init__(self, damping=0.1, torque=100.0, share=SHARE, error=ERROR, first=0.0):
        self.first = first
        self.zeta, self.force, self.share, self.error = damping, torque / RADIUS, share, error

    def stiffness(self, phase):
        return STIFFNESS * (1 + self.share * np.cos(phase))

    def contact(self, phase, x, v):
        """k δ and c δ̇ of the drive flank."""
        k = self.stiffness(phase)
        delta = x + self.error * np.sin(phase + PHASE)
        return k * delta, 2 * self.zeta * math.sqrt(MASS) * np.sqrt(k) * v

    def settled(self, omega, state, periods, samples=256):
        """x (samples,) over the last of some periods, and the state at its end."""
        stop, x = 2 * math.pi / omega, np.zeros(samples)
        times = stop * np.arange(samples) / samples
        for _ in range(periods):
            x, state = self._period(omega, state, times, stop)
        return x, state

    def _period(self, omega, state, times, stop):
        t, x = 0.0, np.zeros(len(times))
        while t < stop * (1 - 1e-14):
            elastic, damped = self.contact(omega * t + self.first, *state)
            phase = self._phase(elastic, damped)
            events = self._events(omega, phase)
            solved = solve_ivp(
                lambda t, y, p=phase: self._slope(omega, t, y, p), (t, stop), state,
                method="DOP853", rtol=1e-10, atol=1e-16, dense_output=True, events=events,
            )  # fmt: skip
            here = (times >= t) & (times <= solved.t[-1])
            if here.any():
                x[here] = solved.sol(times[here])[0]
            t, state = solved.t[-1], solved.y[:, -1]
            if solved.status == 1:
                step = 1e-9 * stop  # off the event
                state = state + step * np.array(self._slope(omega, t, state, phase))
                t += step
        return x, state

    @staticmethod
    def _phase(elastic, damped):
        if elastic <= 0.0:
            return "open"
        if elastic + damped <= 0.0:
            return "pulling"
        return "limited" if damped > elastic else "closed"

    def _slope(self, omega, t, y, phase):
        elastic, damped = self.contact(omega * t + self.first, *y)
        force = {"open": 0.0, "pulling": 0.0, "limited": 2 * elastic, "closed": elastic + damped}
        return [y[1], (self.force - force[phase]) / MASS]

    def _events(self, omega, phase):
        values = {
            "touch": lambda e, d: e, "pull": lambda e, d: e + d, "limit": lambda e, d: e - d,
        }  # fmt: skip
        watched = {"open": ["touch"], "pulling": ["touch", "pull"], "closed": ["pull", "limit"],
                   "limited": ["limit", "touch"]}  # fmt: skip
        events = []
        for name in watched[phase]:

            def event(t, y, value=values[name]):
                return value(*self.contact(omega * t + self.first, *y))

            event.terminal = True
            events.append(event)
        return events
