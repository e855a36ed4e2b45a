"""Load along the face of one tooth pair: CalculiX in three dimensions beside flexgear's slices."""

from dataclasses import dataclass

from rows import INDEPENDENT, Row

from solid_contact import face_load, stored

NAMES = {"fe": "slices that bend each other", "width": "slices beside each other"}
RUNS = ("even", "tilted", "partly open")
K_WITHIN, LOAD_WITHIN = 0.03, 0.05


@dataclass(frozen=True)
class Compared:
    """flexgear at CalculiX's force and tilt. forces (K,) N; k_h_beta; approach: w₀, m, and known
    one; load: largest line load over CalculiX's, less one."""

    forces: face_load.Array
    k_h_beta: float
    approach: float
    load: float


def compared(run: str, compliance: str) -> Compared:
    """One run in as many slices as it has."""
    by_ccx = stored.run(run)
    pair = face_load.pair(by_ccx.s, len(by_ccx.forces), compliance)
    total = float(by_ccx.forces.sum())
    approach = pair.approach(total, by_ccx.tilt)
    forces = pair.forces(approach, by_ccx.tilt)
    return Compared(
        forces,
        float(forces.max() / forces.mean()),
        approach,
        float(forces.max() / by_ccx.forces.max() - 1),
    )


def rows(fidelity: str) -> list[Row]:
    """K_Hβ and largest line load, even and tilted; FE influences not at the quick fidelity."""
    lines = []
    for compliance in ("width",) if fidelity == "quick" else ("width", "fe"):
        for run in RUNS:
            lines += _of(run, compliance)
    return lines


def _of(run: str, compliance: str) -> list[Row]:
    by_ccx, ours = stored.run(run), compared(run, compliance)
    asked = compliance == "fe"
    off = ours.k_h_beta - by_ccx.k_h_beta
    approach = ours.approach / by_ccx.approach - 1
    why = f"{NAMES[compliance]}; same force and tilt; approach {100 * approach:+.1f} %"
    where = f"planet and ring, {run}"

    def row(quantity: str, published: str, computed: str, limit: str, holds: bool) -> Row:
        limit, verdict = (limit, holds) if asked else ("reported", None)
        return Row(
            "solid_contact", where, quantity, published, computed, limit, verdict, why, INDEPENDENT
        )

    loads = [1e-6 * x.max() * len(x) / by_ccx.face_width for x in (by_ccx.forces, ours.forces)]
    return [
        row("K_Hβ", f"{by_ccx.k_h_beta:.3f}", f"{ours.k_h_beta:.3f}", "0.03", abs(off) < K_WITHIN),
        row(
            "largest line load",
            f"{loads[0]:.3f} kN/mm",
            f"{loads[1]:.3f} kN/mm",
            "5 %",
            abs(ours.load) < LOAD_WITHIN,
        ),
    ]
