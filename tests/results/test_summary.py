"""Summary: its keys are declared once, its values plain, gaps are named."""

import copy
import json

import jsonschema
import numpy as np
import pytest
import xarray as xr

from flexgear.files.atomic import write_json
from flexgear.model.errors import FlexgearError
from flexgear.results.labelled_dataset import labelled_dataset
from flexgear.results.quantities import MISSING, values
from flexgear.results.stage_part import pairs_of, stage_part
from flexgear.results.summary import (
    KEYS,
    VERSION,
    build_summary,
    json_schema,
    missing_keys,
    modes_summary,
)
from flexgear.results.time_figures import (
    STAGE_DROP,
    STEADY,
    StageDrop,
    SteadyRun,
    displacement_summary,
    drop_summary,
)
from flexgear.solve.headlines import HEADLINES, rows_schema

SCHEMA = json_schema({"headlines": rows_schema()})
PART = {
    "schema_version": VERSION,
    "stages": {"first": {"kind": "planetary", "gear_mesh_frequency_hz": 5.0}},
    "torque_steps": {"2e6": {"flexible": {"first": {"carrier_speed_rpm_min": 1.0}}}},
    "headlines": [
        {"name": HEADLINES[0].name, "unit": "1", "level": "note", "stage": "first", "value": 1.5,
         "figure": "1.5", "sentence": "Words.", "window": "", "allowable": None},
    ],
}  # fmt: skip


def faults(summary: dict) -> list[str]:
    """What an independent reader of the schema finds but for what is missing."""
    errors = jsonschema.Draft202012Validator(SCHEMA).iter_errors(summary)
    return [e.message for e in errors if e.validator != "required"]


def test_the_schema_is_one_and_takes_what_is_declared():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert faults(PART) == []
    assert len({key.path for key in KEYS}) == len(KEYS)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"mood": 3}, "'mood'"),
        ({"stages": {"first": {"mass": 1.0}}}, "'mass'"),
        ({"stages": {"first": {"gear_mesh_frequency_hz": "5"}}}, "'5' is not of type"),
        ({"schema_version": 1}, f"{VERSION} was expected"),
        ({"headlines": [{**PART["headlines"][0], "level": "fine"}]}, "'fine'"),
    ],
)
def test_the_schema_refuses_keys_and_values_that_it_does_not_declare(change, fault):
    (message,) = faults({**copy.deepcopy(PART), **change})
    assert fault in message


def test_missing_keys_of_a_summary_are_named():
    lost = missing_keys({**PART, "reduction": {"ring": {}}})
    assert "stages.first.sun_gear_mesh_force_n" in lost and "energy_residual" in lost
    assert "torque_steps.2e6.flexible.gear_mesh_force" in lost
    assert "reduction.ring.fe_dofs" in lost
    assert not [name for name in lost if name.startswith(("steady", "headlines"))]


def test_figures_of_flexible_stages_stand_below_their_names():
    lost = missing_keys({"steady": {"first": {}}})
    assert "steady.first.carrier_speed_rpm_mean" in lost


REDUCTION = {
    "fe_dofs": np.int64(100_000),
    "interface_dofs": np.int64(720),
    "fixed_interface_modes": 40,
    "static_error": np.float64(0.004),
    "frequency_error": 0.003,
    "frequency_limit_hz": 2000.0,
}


def drop_of(run):
    return values(STAGE_DROP, StageDrop(run, "stage"))


def star(make_run, teeth=93):
    phi = 2 * np.pi * np.arange(teeth) / teeth
    u = 4e-5 * np.cos(5 * phi)
    field = np.stack([u * np.cos(phi), u * np.sin(phi), 0 * u], axis=-1)
    return make_run(samples=1, sample_dim="position", tooth_displacement=field[None])


def pieces(make_run):
    run = make_run()
    return {
        "case": "sample",
        "variant": "flexible",
        "version": "1",
        "content_hash": "abc",
        "reduction": {"stage.ring": REDUCTION, "stage.carrier": dict(REDUCTION)},
        "steady": {
            "stage": values(
                STEADY,
                SteadyRun("stage", {"flexible": run, "rigid": make_run("rigid")}, star(make_run)),
            )
        },
        "torque_steps": {"2e6": {"flexible": drop_summary(run) | {"stage": drop_of(run)}}},
        "system": dict.fromkeys(
            ("bodies", "coordinates", "kept_modes", "modes_limit_hz", "modes_estimate"), 1
        ),
        "power_flow": {"mobility": 1, "input_power_w": 1.0, "members": {}},
        "stages": {"stage": {"gear_mesh_frequency_hz": 1.0, "sun_gear_mesh_force_n": 1.0}},
        "modes": {"lowest": [], "types": {}},
        "resonance": {
            "margin": 0.1,
            "speed_factors": [1.0],
            "orders": {},
            "ideal": 0,
            "errors": 0,
            "met": [],
        },
        "load_sharing": {"quasi_static": {}, "transient": {}},
        "transient": {"duration_s": 1, "steps": 1, "displacement_um_max": {}},
        "energy_residual": 1e-3,
        "warnings": [],
        "timing_s": {"reduce": 1.0},
        "realtime_factor": 2.0,
    }


def test_complete_and_readable_again(make_run, tmp_path):
    summary = build_summary(**pieces(make_run))
    assert json.loads(write_json(tmp_path / "summary.json", summary).read_text()) == summary
    steady = summary["steady"]["stage"]
    assert len(steady["radial_harmonics_um"]) == 21
    assert steady["radial_harmonics_um"][5] == pytest.approx(40.0)
    assert steady["ring_pairs_in_contact"] == {"3": 1.0}
    assert steady["carrier_speed_rpm_mean"] == pytest.approx(1.18 * 30 / np.pi)
    assert set(steady["load_sharing"]) == {"flexible", "rigid"}


def test_peak_is_the_largest_absolute_value_at_tooth_one(make_run):
    run = make_run()
    run["tooth_displacement"][3, 0, 1] = -7e-5
    peak = SteadyRun("stage", {"flexible": run}, star(make_run)).peak()
    assert peak["y"] == pytest.approx(70.0)


def test_empty_slots_do_not_count_as_lowest_load(make_run):
    run = make_run()
    lowest = StageDrop(run, "stage").lowest_load()
    pairs = pairs_of(stage_part(run, "stage"), "sun", "drive")
    assert lowest == pairs["load"].values[pairs["tooth"].values > 0].min() > 0


def test_every_gap_is_named(make_run):
    some = pieces(make_run)
    del some["reduction"]["stage.carrier"]["fe_dofs"], some["energy_residual"]
    some["torque_steps"]["2e6"]["flexible"].pop("speed_rpm_min")
    with pytest.raises(FlexgearError) as caught:
        build_summary(**some)
    for words in (
        "reduction.stage.carrier.fe_dofs is missing",
        "energy_residual is missing",
        "torque_steps.2e6.flexible.speed_rpm_min is missing",
    ):
        assert words in str(caught.value)


def test_a_ring_of_few_teeth_has_fewer_harmonics(make_run):
    some = pieces(make_run)
    run = SteadyRun("stage", {"flexible": make_run()}, star(make_run, 36))
    some["steady"]["stage"] = values(STEADY, run)
    amplitudes = build_summary(**some)["steady"]["stage"]["radial_harmonics_um"]
    assert len(amplitudes) == 19
    assert max(amplitudes) == amplitudes[5] == pytest.approx(40.0)


def test_numbers_must_be_finite(make_run):
    some = pieces(make_run) | {"realtime_factor": float("nan")}
    with pytest.raises(FlexgearError, match="realtime_factor is not a finite number"):
        build_summary(**some)


def test_load_sharing_that_is_nowhere_defined_is_missing(make_run):
    idle = make_run(ring_gear_mesh_force=np.ones((20, 5)))
    assert "3 % of rated" in idle["load_sharing"].attrs[MISSING]
    assert drop_summary(idle)["load_sharing"]["stage ring"] is None


def double_helical(left, right):
    """Two runs of a stage as the halves of one."""
    sides = []
    for side, run in (("left", left), ("right", right)):
        names = {"gear_mesh": "side", "flank": "flank_side", "group": "group_side"}
        coords = {c: (dim, [side] * run.sizes[dim]) for dim, c in names.items()}
        coords |= {dim: [f"{n} {side}" for n in run[dim].values] for dim in names}
        sides.append(run.assign_coords(coords))
    both = {}
    for name, first in sides[0].data_vars.items():
        dim = next((d for d in ("gear_mesh", "flank", "group") if d in first.dims), None)
        pair = [side[name] for side in sides]
        both[name] = first if dim is None else xr.concat(pair, dim)
    return xr.Dataset(both, attrs=left.attrs)


def test_figures_are_those_of_both_halves(make_run):
    """The right half has the lowest tooth load."""
    left, right = make_run(), make_run()
    right["pair_load"] = 0.5 * right["pair_load"]
    both = drop_of(double_helical(left, right))
    alone = drop_of(left)
    assert both["tooth_load_n_min"] == pytest.approx(0.5 * alone["tooth_load_n_min"])
    assert both["carrier_speed_rpm_min"] == alone["carrier_speed_rpm_min"]


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
    summary = modes_summary(data)
    assert [(m["type"], m["multiplicity"]) for m in summary["lowest"]] == [
        ("rigid", 1), ("translational", 2), ("planet", 1),
    ]  # fmt: skip
    assert summary["types"] == {"rigid": 1, "translational": 2, "planet": 1}


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


def test_a_centred_sun_beside_planets_on_oil_films_stays_at_zero():
    """Films are iterated to 1e-8 of their planets' displacement, which is no orbit of the sun."""
    motion = np.zeros((2, 2, 6))
    motion[1, :, 0] = 5.65e-13, 2e-5
    labels = {"body": ["s.sun", "s.planet_1"]}
    data = labelled_dataset("position", [0, 1], {"body_displacement": motion}, {}, labels)
    assert displacement_summary(data) == {"s.sun": 0.0}
