"""Small ring and carrier that mesh in a fraction of a second."""

from math import radians
from typing import Any

import numpy as np

from flexgear.structures.fe_mesh.carrier import CarrierFeMeshParameters
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.gears import RingFeMeshParameters


def small_ring(**changes: Any) -> RingFeMeshParameters:
    """36 teeth of 10 mm, helical, with five bolts and two fits."""
    values: dict[str, Any] = {
        "teeth": 36,
        "normal_module": 0.01,
        "pressure_angle": radians(20.0),
        "helix_angle": radians(8.0),
        "face_width": 0.1,
        "rim_thickness": 0.06,
        "bolts": 5,
        "bolt_circle_diameter": 0.45,
        "bolt_diameter": 0.012,
        "fits": ((-0.05, -0.03), (0.03, 0.05)),
        "fidelity": "quick",
    }
    return RingFeMeshParameters(**(values | changes))


def small_carrier(**changes: Any) -> CarrierFeMeshParameters:
    """The default carrier at quick fidelity."""
    return CarrierFeMeshParameters(**({"fidelity": "quick"} | changes))


def require_same(one: FeMesh, other: FeMesh) -> None:
    """To the last digit, patches too."""
    np.testing.assert_array_equal(one.points, other.points)
    np.testing.assert_array_equal(one.cells, other.cells)
    assert list(one.facets) == list(other.facets)
    for name, facets in one.facets.items():
        np.testing.assert_array_equal(facets, other.facets[name])


def keys(facets: np.ndarray) -> set[tuple[int, ...]]:
    """Of facets or cells, whatever the order of their vertices."""
    return set(map(tuple, np.sort(facets, axis=1).tolist()))
