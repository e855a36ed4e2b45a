"""Load sharing over the carrier's error and over support stiffness: Figures 9 and 12.

Quasi-static; the paper's own time stepping differs from it by less than its rounding (statements).
"""

from dataclasses import replace
from functools import cache

import numpy as np

from flexgear.arrays import Array
from ren2021.equations import Stage, Supports, matrices
from ren2021.errors import Errors
from ren2021.sharing import CASES, sharing

CYCLES = 500  # of the common period, spread over it
STIFF = 1e10  # N/m, radial support of a member that does not float; the rings' of Table 2
CARRIER_ERRORS = np.linspace(0.0, 100e-6, 6)
STIFFNESSES = np.geomspace(1e7, 1e11, 17)
FLOATING = {
    "nothing floats": Supports(sun=STIFF, carrier=STIFF),
    "sun floats": Supports(carrier=STIFF),
    "sun and carrier float": Supports(),
}
MEMBERS = ("sun", "ring", "carrier")


@cache
def over_carrier_error(form: str, signs: str) -> Array:
    """System LSC for CARRIER_ERRORS, all other errors 20 µm, with what floats as in FLOATING."""
    stage = Stage()
    system = matrices(stage, FLOATING[form])
    all_errors = CASES["all errors"]
    return np.array(
        [
            sharing(
                stage, system, replace(all_errors, carrier=float(e)), signs, True, CYCLES
            ).system
            for e in CARRIER_ERRORS
        ]
    )


@cache
def over_support(member: str, signs: str) -> Array:
    """System LSC for STIFFNESSES of one central member's radial support, all errors 20 µm."""
    return np.array([at_support(member, float(k), signs) for k in STIFFNESSES])


def at_support(member: str, stiffness: float, signs: str, errors: Errors | None = None) -> float:
    """System LSC with one central member's radial support as given, the others of Table 2."""
    stage = Stage()
    system = matrices(stage, replace(Supports(), **{member: stiffness}))
    return sharing(stage, system, errors or CASES["all errors"], signs, True, CYCLES).system


@cache
def over_all_supports(signs: str) -> dict[str, Array]:
    """System LSC of the three error cases with all of Table 2's supports 1 … 15 times as stiff."""
    stage = Stage()
    systems = [matrices(stage, Supports().times(f)) for f in FACTORS]
    return {
        name: np.array([sharing(stage, s, e, signs, True, CYCLES).system for s in systems])
        for name, e in CASES.items()
    }


FACTORS = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 15)
