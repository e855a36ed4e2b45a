"""Parameters of FE meshes: a small ring, and ring, planet and carrier of the bundled stage."""

from dataclasses import replace
from math import radians
from typing import Any

import numpy as np

from flexgear.model.load import load_case
from flexgear.model.stage_view import StageView
from flexgear.structures.fe_mesh.carrier import CarrierFeMeshParameters
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.gears import PlanetFeMeshParameters, RingFeMeshParameters
from flexgear.structures.sources.carrier import source as carrier_source
from flexgear.structures.sources.planet import source as planet_source
from flexgear.structures.sources.ring import source as ring_source


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


def _wind_5mw() -> StageView:
    return load_case("wind-5mw", {"stage.planet.fe.flexible": "true"}).view()


def wind_ring(**changes: Any) -> RingFeMeshParameters:
    """The ring of ``wind-5mw``."""
    return replace(ring_source(_wind_5mw()).parameters, **changes)


def wind_planet(**changes: Any) -> PlanetFeMeshParameters:
    """The planet of ``wind-5mw``."""
    return replace(planet_source(_wind_5mw()).parameters, **changes)


def wind_carrier(**changes: Any) -> CarrierFeMeshParameters:
    """The carrier of ``wind-5mw``, at quick fidelity."""
    return replace(carrier_source(_wind_5mw()).parameters, **({"fidelity": "quick"} | changes))


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
