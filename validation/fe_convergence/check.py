"""Ring and carrier on quick, standard and fine meshes: error estimate of the standard ones."""

import csv
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from matplotlib.figure import Figure
from scipy.optimize import brentq
from scipy.sparse.linalg import LinearOperator, eigsh

from flexgear.model.load import load_stage
from flexgear.structures.build import carrier_body, ring_body
from flexgear.structures.fe_mesh import carrier_of_case, ring_of_case
from flexgear.structures.fem import assemble
from flexgear.structures.interfaces import (
    carrier_interface,
    carrier_supports,
    ring_interface,
    ring_supports,
)
from flexgear.structures.linalg.cholesky import Factor
from flexgear.structures.linalg.threads import single_threaded_blas
from flexgear.views.style import save_figure

HERE = Path(__file__).parent
FIDELITIES = ("quick", "standard", "fine")


def quantities(name, fidelity):
    """dofs, compliance m/N of the loaded node in its direction, six frequencies Hz."""
    case = load_stage("wind-5mw", {"solver.fidelity": fidelity})
    fe_mesh = {"ring": ring_of_case, "carrier": carrier_of_case}[name](case)
    m = case.material
    model = assemble(fe_mesh, m.young_modulus, m.poisson_ratio, m.density)
    if name == "ring":
        interface = ring_interface(case, model)
        supports = ring_supports(case, interface)
    else:
        interface = carrier_interface(case, model)
        supports = carrier_supports(case, interface, 1e9 * np.eye(interface.size))
    rows = interface.rows
    matrix = (model.stiffness + rows.T @ sp.csr_matrix(supports) @ rows).tocsr()
    factor = Factor(matrix)
    loaded = rows[[6 * interface.node_names.index({"ring": "tooth_001"}.get(name, "pin_1")) + 1]]
    compliance = float((loaded @ factor.solve(loaded.T.toarray()))[0, 0])
    inverse = LinearOperator(matrix.shape, lambda v: factor.solve(v.ravel()))
    values = eigsh(matrix, 6, model.mass, sigma=0.0, OPinv=inverse, return_eigenvectors=False)
    return model.dofs, compliance, np.sqrt(np.sort(values)) / 2 / np.pi


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
    with single_threaded_blas():
        found = [quantities(name, fidelity) for fidelity in FIDELITIES]
    sizes = [f[0] for f in found]
    table = np.array([[f[1], *f[2]] for f in found])  # (mesh, quantity)
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
    case = load_stage("wind-5mw", {"ring.tie": tie, "solver.fidelity": "standard"})
    report = {"ring": ring_body, "carrier": carrier_body}[body](case).report
    print(f"\n{body}, {tie}: static {report['static_error_cases']}")
    assert report["static_error"] < accepted
    assert report["frequency_error"] < 0.01
    assert report["frequency_limit_hz"] == 2000.0
