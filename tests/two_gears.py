"""Two gears on soft bearings, and their motion from event to event of their contact."""

from dataclasses import replace

import numpy as np
from contact_events import EventIntegrator
from stepped import jump
from trains import spur_pair, write

from flexgear.analysis.start import start_state
from flexgear.coupling.build import build_system
from flexgear.coupling.kernels.elements import pair_rows, row_motions
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


class Exact(EventIntegrator):
    """The same gears, pairs in place, under another torque."""

    def __init__(self, modal, torque):
        self.system, self.torque = modal.system, torque
        pairs, rows = modal.system.pairs, pair_rows(modal.system.pairs)
        every = np.ones(len(pairs.s0), dtype=np.int64)
        n, _ = build_rows(pairs, rows, np.zeros(len(modal.angles)), every)
        self.rows = row_motions(rows, n, modal.system.blocks)
        self.k, self.c = rows.row["stiffness"][:n].copy(), rows.row["damping"][:n].copy()
        self.gap = -rows.row["offset"][:n]
        self.inverse = np.linalg.inv(modal.system.mass)

    def approach(self, y):
        """δ and δ̇ of the rows."""
        d = len(y) // 2
        return self.rows @ y[:d] - self.gap, self.rows @ y[d:]

    def contact(self, t, y):
        delta, rate = self.approach(y)
        return self.k * delta, self.c * rate

    def slope(self, t, y, loads):
        s, d = self.system, len(y) // 2
        brake = s.machines[-1].rated_torque / s.machines[-1].rated_speed
        output = s.ports[-1].row
        force = s.ports[0].row * self.torque - output * (brake * (output @ y[d:]))
        force = force - s.stiffness @ y[:d] - self.rows.T @ loads
        return np.concatenate([y[d:], self.inverse @ force])


def exact_after(modal, torque, times):
    """Loads (t, rows) of flexgear's start when the torque is another at once; how many events there
    were."""
    start, exact = start_state(modal, TORQUE), Exact(modal, torque)
    y = np.concatenate([modal.modes @ start.eta, modal.modes @ start.velocity])
    out, events = np.zeros((len(times), len(exact.k))), -1
    for states, at, motion, _ in exact.pieces(y, times, times[-1]):
        out[at] = [exact.loads(0.0, y, states) for y in motion] if len(at) else out[at]
        events += 1
    return out, events
