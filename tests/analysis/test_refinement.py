"""Equilibria after a step of iterative refinement."""

import numpy as np
import pytest
from coupled import TORQUE
from error_samples import random_sets

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.kernels.static_position import CLOSURE
from flexgear.coupling.modal import modal_system


@pytest.mark.parametrize(("size", "share"), [(2e-5, 1.0), (3e-4, 0.5), (2e-5, -1.0)])
def test_equilibria_close_far_below_what_is_asked(one_sided, size, share):
    """Loaded, jammed between both flanks, reversed: they closed to 8e-9 without refinement."""
    modal = modal_system(one_sided, 3000.0)
    sets = random_sets(modal.system.pairs, 3, size)
    for j in range(3):
        system = modal.system.with_(pairs=sets.pairs(modal.system.pairs, j))
        found = revolution(modal_system(system, 3000.0), np.linspace(0.0, 2.0, 5), share * TORQUE)
        assert found.closure.max() < 0.1 * CLOSURE
        assert (found.pair_load >= 0.0).all()
