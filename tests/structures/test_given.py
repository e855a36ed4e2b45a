"""Ring and carrier given as reduced matrices: the same machine as with the bodies themselves."""

import math
from dataclasses import replace

import numpy as np
import pytest
from stage_samples import cheap_stage

from flexgear.files.matrices.body import ReducedMatrices
from flexgear.files.matrices.exchange import write_reduced
from flexgear.model.bodies import Material
from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.results.stage_part import pairs_of, stage_part
from flexgear.solve.bodies import stage_bodies
from flexgear.solve.model import assemble
from flexgear.solve.static import static
from flexgear.structures.sources.matrices import first_frequency

# the bolts of the cheap ring stand on 2 m, at +z
QUICK = {
    "solver.fidelity": "quick",
    "stage.ring.fe.bolts.circle_diameter_mm": "2000",
    "stage.ring.fe.end": "+z",
}


def matrices(body, **changes):
    copy = ReducedMatrices(
        body.name, body.node_names, body.positions, body.stiffness, body.mass, None, None
    )
    return replace(copy, **changes)


@pytest.fixture(scope="module")
def cheap():
    """The bundled stage's bodies of springs and point masses."""
    (stage,) = load_case("wind-5mw", QUICK).flexible_stages.values()
    return cheap_stage(stage)


def case_of_matrices(folder, bodies):
    """The bundled case with these bodies as files."""
    settings = dict(QUICK)
    for body in bodies:
        write_reduced(body, folder, "npz")
        settings |= {
            f"stage.{body.name}.fe.fe_mesh": "reduced",
            f"stage.{body.name}.fe.fe_mesh_file": str(folder / f"{body.name}.npz"),
            f"stage.{body.name}.fe.fe_mesh_nodes": str(folder / f"{body.name}_nodes.csv"),
            f"stage.{body.name}.fe.fe_mesh_unit": "m",
        }
    return load_case("wind-5mw", settings)


def test_statics_are_those_of_the_bodies(tmp_path, cheap):
    bodies = [matrices(body) for body in cheap.values()]
    # in another order: names say what is what
    last = [replace(b, node_names=b.node_names[::-1], positions=b.positions[::-1]) for b in bodies]
    turned = []
    for body in last:
        rows = np.arange(len(body.stiffness)).reshape(-1, 6)[::-1].ravel()
        at = np.ix_(rows, rows)
        turned.append(replace(body, stiffness=body.stiffness[at], mass=body.mass[at]))
    case = case_of_matrices(tmp_path, turned)
    (name, stage), *_ = case.flexible_stages.items()
    statics = static(assemble(case, bodies=stage_bodies(stage)), np.radians([0, 36]))
    expected = static(assemble(load_case("wind-5mw", QUICK), bodies=cheap), np.radians([0, 36]))
    for gear in ("ring", "sun"):
        parts = (stage_part(one, name) for one in (expected, statics))
        a, b = (pairs_of(part, gear, "drive")["load"].values for part in parts)
        assert b == pytest.approx(a, rel=1e-7, abs=1e-7 * np.abs(a).max())


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda b: {"node_names": ("odd", *b.node_names[1:])}, "lacks tooth_001"),
        (lambda b: {"positions": 1e-3 * b.positions}, "is at"),
        (lambda b: {"positions": b.positions + [0.05, 0, 0]}, "it belongs to"),
        (lambda b: {"mass": 1e-3 * b.mass}, "check fe_mesh_unit"),
        (lambda b: {"stiffness": 1e3 * b.stiffness}, "check the unit of its forces"),
        (lambda b: {"stiffness": 1e-3 * b.stiffness}, "natural frequency of 6.08 Hz; a steel"),
        (lambda b: {"stiffness": b.stiffness + np.eye(len(b.mass)) * 1e9}, "rigid motion"),
        (lambda b: {"stiffness": b.stiffness[6:]}, "stiffness: is 714 x 720"),
        (lambda b: {"mass": b.mass[6:, 6:]}, "mass: is 714 x 714"),
    ],
)
def test_what_does_not_fit_the_case_is_refused(tmp_path, cheap, spoil, message):
    ring = matrices(cheap["stage.ring"])
    case = case_of_matrices(tmp_path, [replace(ring, **spoil(ring))])
    (stage,) = case.flexible_stages.values()
    with pytest.raises(InputError, match=message) as caught:
        stage_bodies(stage)
    assert "stage.ring.fe.fe_mesh_file" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("width", [0.05, 0.1, 0.6])
def test_first_frequency_of_thin_rings_is_that_of_love(width):
    """ω = n (n² − 1)/√(n² + 1) √(E I/(ρ A R⁴)), n = 2, whatever the width; its face at z = 0."""
    steel = Material(young_modulus=206e9, poisson_ratio=0.3, density=7850)
    radius, thickness = 1.5, 1.5 / 40
    mass = steel.density * 2 * math.pi * radius * thickness * width
    across = radius**2 / 2 + width**2 / 3  # about the face
    inertia = np.diag([1, 1, 1, across, across, radius**2])
    inertia[:2, 3:5] = np.array([[0, 1], [-1, 0]]) * width / 2
    inertia[3:, :3] = inertia[:3, 3:].T
    bending = steel.young_modulus * thickness**2 / 12 / (steel.density * radius**4)
    expected = 6 / math.sqrt(5) * math.sqrt(bending) / (2 * math.pi)
    assert first_frequency("ring", mass * inertia, steel) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"stage.ring.fe.fe_mesh": "reduced"}, "fe_mesh_file"),
        ({"stage.ring.fe.fe_mesh": "reduced", "stage.ring.fe.fe_mesh_file": "a.op4"},
         "fe_mesh_nodes"),
        ({"stage.ring.fe.fe_mesh_nodes": "a.csv"}, 'set fe_mesh = "reduced"'),
        (
            {"stage.ring.fe.fe_mesh": "reduced", "stage.ring.fe.fe_mesh_file": "a.op4",
             "stage.ring.fe.fe_mesh_nodes": "a.csv",
             "stage.ring.fe.fe_mesh_turn_deg": "3"},
            "cannot move a reduced body",
        ),
    ],
)  # fmt: skip
def test_keys_that_belong_together(settings, message):
    with pytest.raises(InputError, match=message):
        load_case("wind-5mw", settings)
