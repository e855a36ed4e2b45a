"""A made-up run for the tests of this folder."""

import numpy as np
import pytest

from flexgear.results.dataset import provenance, transient_dataset

TIMES, PLANETS, SLOTS, TEETH = 20, 5, 4, 93


@pytest.fixture
def make_run():
    """Function that builds a small dataset with every kind of axis; keywords replace arrays."""

    def make(variant="flexible", samples=TIMES, **changes):
        rng = np.random.default_rng(7)
        shape = (samples, PLANETS, SLOTS)
        load = rng.uniform(1e4, 2e5, shape)
        tooth = rng.integers(1, TEETH + 1, shape).astype(np.int16)
        tooth[..., 3] = 0
        load[tooth == 0] = 0
        arrays = {
            "carrier_angle": np.linspace(0, 1, samples),
            "carrier_speed": np.full(samples, 1.18),
            "ring_pair_load": load,
            "ring_pair_tooth": tooth,
            "sun_pair_load": load / 2,
            "sun_pair_tooth": tooth,
            "ring_gear_mesh_force": load.sum(-1),
            "tooth_displacement": rng.normal(size=(samples, TEETH, 3)) * 1e-5,
            "carrier_displacement": np.zeros((samples, 2, 6)),
            "carrier_node": ["drive", "pin_1"],
            "bolt_force": np.zeros((samples, 25, 3)),
            "tooth_angle": 2 * np.pi * np.arange(TEETH) / TEETH,
        } | changes
        attrs = provenance(
            case="sample", variant=variant, content_hash="abc", parameters={"stage": {"planets": 5}}
        )
        return transient_dataset(
            time=np.linspace(0, 1, samples), attrs=attrs, rated_mean_force=4e5, **arrays
        )

    return make
