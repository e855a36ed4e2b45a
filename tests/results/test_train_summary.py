"""Summaries of trains are complete, plain and finite."""

import numpy as np
import pytest

from flexgear.model.errors import FlexgearError
from flexgear.results.labelled_dataset import labelled_dataset
from flexgear.results.summary import build_summary, modes_summary
from flexgear.results.time_figures import displacement_summary


def test_missing_and_infinite_figures_are_named():
    with pytest.raises(FlexgearError, match=r"version is missing.*realtime_factor is not a finite"):
        build_summary(case="x", realtime_factor=float("nan"))


def test_repeated_modes_are_listed_once():
    data = labelled_dataset(
        "mode",
        [1, 2, 3, 4],
        {
            "frequency": [0.0, 10.0, 10.0, 10.0],
            "type": np.array(["rigid", "translational", "translational", "planet"]),
            "multiplicity": [1, 2, 2, 1],
        },
        {},
        {},
    )
    found = modes_summary(data)
    assert [(m["type"], m["multiplicity"]) for m in found["lowest"]] == [
        ("rigid", 1), ("translational", 2), ("planet", 1),
    ]  # fmt: skip
    assert found["types"] == {"rigid": 1, "translational": 2, "planet": 1}


def test_distance_from_the_axis_is_the_largest_of_central_members():
    motion = np.zeros((3, 3, 6))
    motion[1, 0, :2] = 3e-6, 4e-6
    motion[:, 2, :2] = 1.0
    data = labelled_dataset(
        "position",
        [0, 1, 2],
        {"body_displacement": motion},
        {},
        {"body": ["s.sun", "s.ring_left", "s.planet_1"]},
    )
    assert displacement_summary(data) == {"s.sun": pytest.approx(5.0), "s.ring_left": 0.0}
