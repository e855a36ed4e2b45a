"""A tolerance study made up for tests of what is done with one."""

import json

import numpy as np

from flexgear.model.names import GearMeshName
from flexgear.results.tolerance_dataset import tolerance_dataset

GROUPS = (("stage_1", "ring", 3), ("stage_1", "sun", 3), ("stage_2", "ring", 4))
GEAR_MESHES = tuple(
    GearMeshName.of(stage, kind, "", planet + 1)
    for stage, kind, planets in GROUPS
    for planet in range(planets)
)


def study_data(count=50, gaps=(), drawn=True):
    """Ring and sun of one stage are equal; the other stage always shares evenly."""
    rng = np.random.default_rng(1)
    one = 1 + 0.05 * rng.gamma(2.0, size=(count, 1))
    largest = np.hstack([one, one, np.ones((count, 1))])
    largest[list(gaps)] = np.nan
    planets = rng.normal(1.0, 0.05, (count, len(GEAR_MESHES)))
    sizes, phases = (["stage_1.a 1", "stage_1.a 2"], ["stage_1.b"]) if drawn else ([], [])
    return tolerance_dataset(
        {
            "error_size": rng.normal(0, 1e-5, (count, len(sizes))),
            "error_phase": rng.uniform(0, 6, (count, len(phases))),
            "load_sharing_max": largest,
            "load_sharing_mean": 1 + 0.5 * (largest - 1),
            "planet_load_factor_max": planets + 0.01,
            "planet_load_factor_mean": planets,
            "load_sharing_as_stated": np.array([1.08, 1.08, 1.0]),
        },
        sizes=sizes,
        phases=phases,
        gear_meshes=GEAR_MESHES,
        confidence=0.95,
        attrs={
            "case": "made up", "variant": "lumped", "content_hash": "0", "version": "0",
            "seed": 1, "positions": json.dumps({"stage_1 ring": 4}),
        },
    )  # fmt: skip
