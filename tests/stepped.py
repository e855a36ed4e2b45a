"""Transients in memory, and what the balance of their energy leaves over."""

from dataclasses import dataclass

import numpy as np

from flexgear.analysis.step_plan import Stepping
from flexgear.analysis.transient import Drive, run_in_memory


@dataclass(frozen=True)
class Jumping(Drive):
    """A drive that jumps at these times, s."""

    jumps: tuple[float, ...] = ()


def jump(torque, other, at, until=np.inf):
    """A torque, and another one between two times, s."""
    jumps = tuple(t for t in (at, until) if t < np.inf)
    return Jumping(lambda t: np.where((t > at) & (t < until), other, torque), jumps=jumps)


def stepped(modal, drive, duration, step, interval=None, *, windows=(), adaptive=None, **options):
    """A transient in flexgear's steps, with samples every ``interval`` s, or at every step."""
    jumps = getattr(drive, "jumps", ())
    stepping = Stepping(duration, step, interval or step, jumps, windows, adaptive)
    return run_in_memory(modal, drive, stepping, **options)


def energy_error(run):
    """Energy that appeared from nowhere, over the peak of elastic energy."""
    e = run.energy
    held = e["kinetic"] + e["elastic"] + e["pair_elastic"]
    work = e["input_work"] - e["brake_work"] - e["damping_work"] - e["pair_damping_work"]
    left = held - work - e["parametric_work"] - e["load_work"]
    return np.abs(left - left[0]).max() / (e["elastic"] + e["pair_elastic"]).max()


ROUNDING = 1e-10  # of the largest elastic energy, over thousands of steps


def energy_closes(modal, drive, duration, steps=(4e-5, 2e-5), *, most=1e-3, share=0.5):
    """Runs of two steps, s, whose energy closes, the better the shorter they are, or within
    rounding; the last run."""
    runs = [stepped(modal, drive, duration, h, 2e-4, track_energy=True) for h in steps]
    errors = [energy_error(run) for run in runs]
    assert errors[1] < most
    assert errors[1] < max(share * errors[0], ROUNDING)
    return runs[1]
