"""Energy that time steps make from nothing: teeth that part and hammer, undamped, in coarse steps.

Average acceleration keeps the energy of a linear system. Where contact opens or closes within a
step it errs by an energy of second order in the step, of either sign; without damping of the gear
meshes nothing takes it away, harder impacts err by more, and loads grow without limit. What the
account leaves over (``energy.LEFT_OVER``) tells: in runs that converge it stays a thousandth of
the elastic energy, or is negative; where they do not it soon is several times that.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.kernels.energy import ENERGIES, LEFT_OVER
from flexgear.coupling.modal import ModalSystem

Array = NDArray[np.float64]
SIGNS = np.array([LEFT_OVER[name] for name in ENERGIES])
ELASTIC = [ENERGIES.index(name) for name in ("elastic", "pair_elastic")]
TAKEN = [ENERGIES.index(name) for name in ("damping_work", "pair_damping_work")]
ROUNDING = 1e-9  # of all energy
MOST = 3.0  # times the mean elastic energy: with so much gained, loads are doubled


def undamped_contact(modal: ModalSystem) -> bool:
    """Whether teeth may part and nothing damps their impacts."""
    pairs = modal.system.pairs
    return bool(pairs.one_sided and not pairs.damping.any())


class EnergyGain:
    """Follows what the account of a run leaves over, from its samples."""

    def __init__(self) -> None:
        self._first = self._elastic = 0.0
        self._samples = 0

    def too_much(self, energy: Array) -> int | None:
        """First of some samples more (n, 9), J, at which the run has gained more than ``MOST``
        times the mean elastic energy up to there and all that damping took; None: not one."""
        left, elastic = energy @ SIGNS, energy[:, ELASTIC].sum(axis=1)
        if not self._samples and len(left):
            self._first = float(left[0])
        total = self._elastic + np.cumsum(elastic)
        mean = total / (self._samples + np.arange(1, len(left) + 1))
        if len(left):
            self._elastic, self._samples = float(total[-1]), self._samples + len(left)
        allowed = MOST * mean + energy[:, TAKEN].sum(axis=1) + ROUNDING * np.abs(energy).max(axis=1)
        over = np.flatnonzero(left - self._first > allowed)
        return int(over[0]) if len(over) else None
