"""Made-up runs for the tests of this folder."""

import numpy as np
import pytest

from flexgear.model.load import load_case
from flexgear.model.names import GearMeshName
from flexgear.results.dataset_file import provenance
from flexgear.results.labelled_dataset import labelled_dataset
from flexgear.results.load_sharing import sharing_histories
from flexgear.results.stage_part import PARTS, stage_part

KINDS = ("ring", "sun")
FLANKS = (("drive", "pair"), ("coast", "coast_pair"))
TIMES, PLANETS, SLOTS, TEETH = 20, 5, 4, 93
RATED = 4e5  # N a planet


def sample_run(variant="flexible", samples=TIMES, stage="stage", sample_dim="time", **changes):
    """A dataset of one flexible stage with every kind of axis.

    changes: arrays in the words of the stage ("ring_pair_load", …) in place of the usual ones.
    """
    rng = np.random.default_rng(7)
    shape = (samples, PLANETS, SLOTS)
    load = rng.uniform(1e4, 2e5, shape)
    tooth = rng.integers(1, TEETH + 1, shape).astype(np.int16)
    tooth[..., 3] = 0
    load[tooth == 0] = 0
    variables = {
        "ring_pair_load": load,
        "ring_pair_tooth": tooth,
        "sun_pair_load": load / 2,
        "sun_pair_tooth": tooth,
        "ring_gear_mesh_force": load.sum(-1),
        "carrier_angle": np.linspace(0, 1, samples),
        "carrier_speed": np.full(samples, 1.18),
        "tooth_displacement": rng.normal(size=(samples, TEETH, 3)) * 1e-5,
        "carrier_displacement": np.zeros((samples, 1 + PLANETS, 6)),
        "bolt_force": np.zeros((samples, 25, 3)),
    } | changes
    arrays, labels = _flanks(variables, stage)
    names = [GearMeshName.of(stage, kind, "", i + 1) for kind in KINDS for i in range(PLANETS)]
    force = np.hstack([variables.pop("ring_gear_mesh_force"), load.sum(-1) / 2])
    rated = np.full(len(names), RATED)
    arrays |= {
        "gear_mesh_force": force,
        "rated_gear_mesh_force": rated,
        **sharing_histories(force, rated, names),
        "stage_angle": variables.pop("carrier_angle")[:, None],
        "input_speed": variables["carrier_speed"][:, None],
        "stage_speed": variables.pop("carrier_speed")[:, None],
        "port_torque": np.tile([4e6, -9e5], (samples, 1)),
    }
    teeth = variables["tooth_displacement"].shape[1]
    labels |= {
        "turning_stage": [stage],
        "input_coordinate": [f"{stage}.carrier"],
        "port": [f"{stage}.carrier", f"{stage}.sun"],
        "carrier_node": [f"{stage}.drive", *(f"{stage}.pin_{i + 1}" for i in range(PLANETS))],
        "bolt": [f"{stage}.bolt_{k + 1:02d}" for k in range(variables["bolt_force"].shape[1])],
        "tooth_stage": [stage] * teeth,
        "tooth_side": [""] * teeth,
        "tooth_number": np.arange(1, teeth + 1),
        "tooth_angle": 2 * np.pi * np.arange(teeth) / teeth,
    }
    attrs = provenance(load_case("lin-parker"), variant)
    ticks = np.linspace(0, 1, samples) if sample_dim == "time" else np.arange(samples)
    return labelled_dataset(sample_dim, ticks, arrays | variables, attrs, labels, names)


def _flanks(variables, stage):
    """Pairs of gears and flanks, taken out of ``variables``, on one axis, and its labels."""
    flanks = [
        (kind, sense, word)
        for kind in KINDS
        for sense, word in FLANKS
        if f"{kind}_{word}_load" in variables
    ]
    arrays = {}
    for part in PARTS:
        columns = [variables.pop(f"{kind}_{word}_{part}", None) for kind, _, word in flanks]
        if all(c is not None for c in columns):
            arrays[f"pair_{part}"] = np.concatenate(columns, axis=1)
    at = [(kind, sense, i + 1) for kind, sense, _ in flanks for i in range(PLANETS)]
    return arrays, {
        "flank": [f"{stage} {kind} {i} {sense}" for kind, sense, i in at],
        "flank_stage": [stage] * len(at),
        "flank_kind": [kind for kind, _, _ in at],
        "flank_side": [""] * len(at),
        "flank_planet": [i for _, _, i in at],
        "flank_sense": [sense for _, sense, _ in at],
    }


@pytest.fixture
def make_run():
    """Function that builds a run; keywords replace its arrays."""
    return sample_run


@pytest.fixture
def make_part():
    """Function that builds the part of a run that belongs to its flexible stage."""
    return lambda *args, **changes: stage_part(sample_run(*args, **changes), "stage")
