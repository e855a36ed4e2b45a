"""Ring and carrier on quick, standard and fine meshes: error estimate of the standard ones."""

import csv
from pathlib import Path

import numpy as np
import pytest
from face_load.runs import FEW_MODES
from matplotlib.figure import Figure
from scipy.optimize import brentq

from flexgear.model.load import load_case
from flexgear.model.names import BodyName
from flexgear.structures.sources.of_case import fe_sources
from flexgear.views.style import save_figure

HERE = Path(__file__).parent
FIDELITIES = ("quick", "standard", "fine")


def reduced(name, **changes):
    """The bundled ring or carrier, from the cache if it was reduced before."""
    case = load_case("wind-5mw", changes).view()
    source = fe_sources(case)[BodyName.of(case.name, name)]
    return source, source.reduced()


def quantities(name, fidelity):
    """dofs of the FE mesh, compliance m/N of the loaded node in its direction by the reduced body,
    whose statics are exact, and the six lowest frequencies Hz of the FE mesh, with which reductions
    are compared, all on the body's supports; with few modes where nothing else takes this body."""
    keys = {"solver.fidelity": fidelity, **({} if fidelity == "standard" else FEW_MODES)}
    source, body = reduced(name, **keys)
    stiffness = body.stiffness.copy()
    b = body.interface_dofs
    stiffness[:b, :b] += source.supports(body.node_names, 1e9 * np.eye(b))
    loaded = 6 * body.node_names.index({"ring": "tooth_001"}.get(name, "pin_1")) + 1
    compliance = np.linalg.solve(stiffness, np.eye(1, len(stiffness), loaded)[0])[loaded]
    return body.report["fe_dofs"], compliance, body.report["compared_frequencies_hz"][:6]


def richardson(sizes, values):
    """Extrapolated value and observed order (nan: the change to the finest mesh counts)."""
    h1, h2, h3 = np.array(sizes, dtype=float) ** (-1 / 3)
    a, b, c = values
    if (b - a) * (c - b) > 0:

        def mismatch(p):
            return (b - a) / (c - b) - (h1**p - h2**p) / (h2**p - h3**p)

        if mismatch(1.0) * mismatch(6.0) < 0:
            p = brentq(mismatch, 1.0, 6.0)
            return c + (c - b) * h3**p / (h2**p - h3**p), p
    return c, np.nan


@pytest.mark.parametrize("name", ["ring", "carrier"])
def test_standard_mesh_is_fine_enough(name, results):
    with (HERE / "reference.csv").open() as stream:
        accepted = {
            row["quantity"]: float(row["accepted_error_of_standard"])
            for row in csv.DictReader(stream)
            if row["body"] == name
        }
    by_fidelity = [quantities(name, fidelity) for fidelity in FIDELITIES]
    sizes = [f[0] for f in by_fidelity]
    table = np.array([[f[1], *f[2]] for f in by_fidelity])  # (mesh, quantity)
    limits = np.array([richardson(sizes, column)[0] for column in table.T])
    orders = [richardson(sizes, column)[1] for column in table.T]
    errors = np.abs(table / limits - 1)
    print(f"\n{name}: dofs {sizes}, orders {np.round(orders, 1)}\n{np.round(100 * errors, 3)} %")
    figure = Figure(figsize=(6, 4), layout="constrained")
    axes = figure.subplots()
    labels = ["compliance", *(f"frequency {k}" for k in range(1, 7))]
    for column, label in zip(errors.T, labels, strict=True):
        axes.loglog(sizes, np.maximum(column, 1e-6), "o-", label=label)
    axes.set(xlabel="dofs", ylabel="relative error (Richardson)", title=name)
    axes.legend(fontsize=7)
    save_figure(figure, results / "fe_convergence" / f"{name}.png", dpi=120)
    assert errors[1, 0] < accepted["compliance"]
    assert errors[1, 1:].max() < accepted["frequency"]


@pytest.mark.parametrize(
    ("body", "tie", "accepted"),
    [("ring", "root", 0.02), ("ring", "flank", 0.03), ("carrier", "root", 0.02)],
)
def test_reduction_at_standard_stays_within_its_accepted_errors(body, tie, accepted):
    """Against the unreduced model: every load line by itself, frequencies to 2 kHz."""
    report = reduced(body, **{"stage.ring.fe.tie": tie, "solver.fidelity": "standard"})[1].report
    print(f"\n{body}, {tie}: static {report['static_error_cases']}")
    assert report["static_error"] < accepted
    assert report["frequency_error"] < 0.01
    assert report["frequency_limit_hz"] == 2000.0
