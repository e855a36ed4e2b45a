r"""Fixed-interface modes of a body of equal sectors, from a shift among them.

    (K - sigma M) x = M v + B^T rho,   B x = 0

is solved as easily as with sigma = 0, and with sigma near the highest frequency that is sought the
modes lie far apart for the iteration. K - sigma M is not definite, but the interior of a sector
between its borders is while its own frequencies lie above; where they do not, sigma is lowered.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from flexgear.model.errors import FlexgearError
from flexgear.structures.cyclic_condensation import CyclicCondensation
from flexgear.structures.cyclic_lanczos import lowest_modes
from flexgear.structures.cyclic_solver import CyclicSolver
from flexgear.structures.cyclic_spectrum import lowest_values
from flexgear.structures.lanczos import Eigenpairs

Array = NDArray[np.float64]

BLOCK = 4  # vectors a step: columns of all sectors make them wide
_BASIS_BYTES = 2.0e9  # of the basis, where that is enough for the modes
_SHARE = 0.75  # of the highest omega^2 sought, where the shift goes


def cyclic_modes(
    condensation: CyclicCondensation, count: int, progress: Callable[[float], None]
) -> Eigenpairs:
    """The `count` lowest modes with the interface held, and its reactions to M Phi beside them."""
    dofs = condensation.dofs
    least, roomy = 3 * count // 2 + 4 * BLOCK, 4 * count + 8 * BLOCK
    most = min(roomy, max(least, int(_BASIS_BYTES / (8 * dofs))), dofs - BLOCK)
    start = np.random.default_rng(20230617).standard_normal((dofs, BLOCK))
    shift, solver = _shifted(condensation, count)

    def solve(load: Array) -> tuple[Array, Array]:
        x, reactions = solver.solve(load.reshape(-1, solver.count, load.shape[1]))
        return x.reshape(dofs, -1), reactions

    def reactions(load: Array) -> Array:
        return condensation.solver.reactions(load.reshape(-1, solver.count, load.shape[1]))

    return lowest_modes(
        solve,
        condensation.mass_product,
        start,
        count,
        most,
        progress=progress,
        shift=shift,
        unshifted=reactions,
    )


def _shifted(condensation: CyclicCondensation, count: int) -> tuple[float, CyclicSolver]:
    """sigma and the solver with it."""
    inertia = condensation.motion.inertia
    shift = _SHARE * float(lowest_values(condensation.solver, inertia, count)[-1])
    for _ in range(8):
        try:
            return shift, condensation.shifted(shift)
        except FlexgearError:
            shift *= 0.5
    return 0.0, condensation.solver
