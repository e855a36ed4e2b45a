"""Two gears on soft bearings, and their motion by an integrator that stops at every contact event.

The law of tooth pairs is written down here once more, as four states and the events between them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp
from stepped import jump
from trains import spur_pair, write

from flexgear.analysis.modes import row_vectors
from flexgear.analysis.start import start_state
from flexgear.coupling.build import build_system
from flexgear.coupling.kernels.elements import pair_rows
from flexgear.coupling.kernels.pairs import build_rows
from flexgear.coupling.modal import modal_system
from flexgear.model.load import load_case

TORQUE = 500.0


def gears_text(model="constant", law="one-sided", damping=0.1, speed=10, backlash=20):
    """TOML text of the two gears."""
    gear_mesh = f'model = "{model}"\ncontact_law = "{law}"\ndamping_ratio = {damping}'
    undamped = "[damping]\nratio = 0.0"
    return spur_pair(
        gear_mesh=gear_mesh, backlash=backlash, speed=speed, torque=TORQUE, sections=undamped
    )


def two_gears(folder, **options):
    """Coupled system and all its modes; options: of ``gears_text``."""
    return modal_system(build_system(load_case(write(folder, gears_text(**options)))))


def evenly_stiff(modal):
    """The same with pairs of one stiffness along their path: turning by microns changes nothing."""
    pairs = modal.system.pairs
    k = np.where(pairs.k_table > 0, pairs.k_table.max(), 0.0)
    return replace(modal, system=modal.system.with_(pairs=pairs._replace(k_table=k)))


def reversal(torque, at):
    """Rated torque, then another."""
    return jump(TORQUE, torque, at)


class Exact:
    """The same gears, pairs in place, between events of their contact.

    States of a row: apart (δ < 0), pulling (δ > 0, k δ + c δ̇ < 0, no load), damped (k δ + c δ̇),
    limited (2 k δ, as c δ̇ > k δ).
    """

    def __init__(self, modal, torque):
        self.system, self.torque = modal.system, torque
        pairs, rows = modal.system.pairs, pair_rows(modal.system.pairs)
        every = np.ones(len(pairs.s0), dtype=np.int64)
        n, _ = build_rows(pairs, rows, np.zeros(len(modal.angles)), every)
        self.rows = row_vectors(modal.system, rows, n)
        self.k, self.c = rows.row["stiffness"][:n].copy(), rows.row["damping"][:n].copy()
        self.gap = -rows.row["offset"][:n]

    def approach(self, y):
        """δ and δ̇ of the rows."""
        d = len(y) // 2
        return self.rows @ y[:d] - self.gap, self.rows @ y[d:]

    def state_of(self, y):
        delta, rate = self.approach(y)
        damped = self.k * delta + self.c * rate
        return tuple(
            "apart" if x < 0 else "pulling" if f < 0 else "limited" if f > 2 * k * x else "damped"
            for x, f, k in zip(delta, damped, self.k, strict=True)
        )

    def loads(self, y, states):
        delta, rate = self.approach(y)
        of = {
            "apart": 0.0 * delta, "pulling": 0.0 * delta, "limited": 2 * self.k * delta,
            "damped": self.k * delta + self.c * rate,
        }  # fmt: skip
        return np.array([of[state][i] for i, state in enumerate(states)])

    def run(self, y, times):
        """Loads (t, rows) at ``times`` from the state y at times[0]; how many events there were."""
        s, d = self.system, len(y) // 2
        solve = np.linalg.inv(s.mass)
        brake = s.machines[-1].rated_torque / s.machines[-1].rated_speed
        output = s.ports[-1].row

        def slope(_, y, states):
            force = s.ports[0].row * self.torque - output * (brake * (output @ y[d:]))
            force = force - s.stiffness @ y[:d] - self.rows.T @ self.loads(y, states)
            return np.concatenate([y[d:], solve @ force])

        def event(i, of):
            def at(_, y, states):
                delta, rate = (part[i] for part in self.approach(y))
                k, c = self.k[i], self.c[i]
                return {
                    "touch": delta,
                    "pull": k * delta + c * rate,
                    "limit": k * delta - c * rate,
                }[of]

            at.terminal = True
            return at

        watched = {"apart": ["touch"], "pulling": ["touch", "pull"],
                   "damped": ["pull", "limit"], "limited": ["limit", "touch"]}  # fmt: skip
        out, t, count = np.zeros((len(times), len(self.k))), times[0], 0
        states = self.state_of(y)
        while True:
            events = [event(i, of) for i, state in enumerate(states) for of in watched[state]]
            late = times[times >= t]
            if t > times[0]:  # off the event that has just been
                step = 1e-6 * (times[1] - times[0])
                y, t = y + step * slope(t, y, states), t + step
            if t >= times[-1]:
                return out, count
            found = solve_ivp(
                slope, (t, times[-1]), y, method="DOP853", rtol=1e-10, atol=1e-14, args=(states,),
                t_eval=late[late >= t], events=events,
            )  # fmt: skip
            at = np.searchsorted(times, found.t)
            out[at] = [self.loads(one, states) for one in found.y.T] if len(at) else out[at]
            if found.status == 0:
                return out, count
            pairs = zip(found.t_events, found.y_events, strict=True)
            t, y = next((t[0], y[0]) for t, y in pairs if len(t))
            after = 1e-6 * (times[1] - times[0])
            states = self.state_of(y + after * slope(t, y, states))
            count += 1


def exact_after(modal, torque, times):
    """Loads of flexgear's start when the torque is another at once: (t, rows)."""
    start = start_state(modal, TORQUE)
    y = np.concatenate([modal.modes @ start.eta, modal.modes @ start.velocity])
    return Exact(modal, torque).run(y, times)
