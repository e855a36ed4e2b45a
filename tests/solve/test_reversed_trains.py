"""Any sense of torque, and either side as the input, under every contact law of a train.

The mirror: half a turn about a stage's x axis leaves its gears, hands and planets as they are and
turns torque and rotation round, so that coast flanks carry at −θ what drive flanks carry at θ.
Planet i stands where N − i stood, the right half of a double-helical stage where the left one did.
"""

from dataclasses import replace

import numpy as np
import pytest
from train_contexts import BUNDLED, mixed, put_together

from flexgear.analysis.equilibrium import revolution
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.model.load import load_case
from flexgear.solve.model import model_of, rated_rotations
from flexgear.solve.static import static

OTHER = {"left": "right", "right": "left", "": ""}
TRUE_TEETH = [n for n in BUNDLED if n != "lin-parker"]


def with_law(name, law, model=None, stages=None, **more):
    """A bundled train with the contact law, and the model, in some or all of its stages; without
    backlash where it says none, so that no planet is free between its flanks."""
    bare = load_case(name).stages
    numbers = list(stages or range(len(bare)))
    at = ["stage"] if len(bare) == 1 else [f"stages.{i}" for i in numbers]
    keys = {f"{s}.gear_mesh.contact_law": law for s in at}
    for s, i in zip(at, numbers, strict=True):
        roles = ("sun", "ring") if bare[i].kind == "planetary" else ("sun",)
        left_out = [k for k in roles if getattr(bare[i], f"backlash_{k}") is None]
        keys |= {f"{s}.backlash_{k}_mm": "0" for k in left_out}
    keys |= {f"{s}.gear_mesh.model": model for s in at if model}
    return load_case(name, {**keys, **more})


def mean_over_planets(model, data):
    groups = {n.group: [] for n in model.gear_meshes.names}
    for k, n in enumerate(model.gear_meshes.names):
        groups[n.group].append(k)
    force = data["gear_mesh_force"].values
    return np.stack([force[:, at].mean(axis=1) for at in groups.values()], axis=1)


@pytest.mark.parametrize(
    ("law", "share"),
    [
        ("first", -0.76),
        ("one-sided", -0.76),
        ("one-sided", -1e-6),
        ("linear", -0.76),
        ("one-sided", 1.0),
    ],
)
@pytest.mark.parametrize("name", BUNDLED)
def test_forces_and_torques_are_those_of_the_power_flow(name, law, share):
    """Whatever flanks carry: means over the planets are the power flow's, reversed where torque
    is."""
    stages = [0] if law == "first" else None
    model = put_together(with_law(name, law.replace("first", "one-sided"), stages=stages))
    data = static(model, [0.0, 0.3], share * model.system.rated_torque)
    rated = {n.group: f for n, f in zip(model.gear_meshes.names, model.rated, strict=True)}
    expected = share * np.array(list(rated.values()))
    # errors load the gears of some trains with more than the torque does
    scale = np.abs(data["gear_mesh_force"].values).max()
    np.testing.assert_allclose(
        mean_over_planets(model, data), np.tile(expected, (2, 1)), rtol=1e-8, atol=1e-9 * scale
    )
    for port in data.port.values:
        torque = share * model.flow.torque[port]
        np.testing.assert_allclose(data["port_torque"].sel(port=port), torque, rtol=1e-7)


@pytest.mark.parametrize(
    ("name", "model"),
    [(n, "per_pair") for n in TRUE_TEETH] + [("nrel-5mw", "lumped"), ("lin-parker", "fourier")],
)
def test_coast_flanks_carry_the_mirrored_loads_of_the_drive_flanks(name, model):
    """Phases are mirrored, too: coast flanks, thinner by the backlash, meet a little later."""
    model = put_together(with_law(name, "one-sided", model))
    system = model.without_errors().system
    mirror = _mirrored(model)
    phase = np.where(system.pairs.carries == 1, system.pairs.s0, system.pairs.s0[mirror])
    system = system.with_(pairs=system.pairs._replace(s0=phase))
    modal = replace(model.modal, system=system)
    torque = 0.8 * system.rated_torque
    ahead = revolution(modal, rated_rotations(system, [0.0, 0.011]), torque)
    back = revolution(modal, rated_rotations(system, [0.0, -0.011]), -torque)
    a, b = (np.sort(e.pair_load, axis=-1) for e in (ahead, back))
    np.testing.assert_allclose(b[:, mirror], a, atol=1e-7 * a.max())
    carrying = a.sum(axis=(0, 2)) > 0
    assert np.array_equal(carrying, system.pairs.carries == 1)


def _mirrored(model):
    """Number of the gear mesh that is the mirror image of every one."""
    labels = model.system.gear_meshes
    place = {(x.stage, x.kind, x.side, x.planet): m for m, x in enumerate(labels)}
    numbers = []
    for x in labels:
        planets = model.case.stages[x.stage].planets
        flank = x.kind.removesuffix("_coast") if x.kind.endswith("_coast") else f"{x.kind}_coast"
        numbers.append(place[x.stage, flank, OTHER[x.side], -x.planet % planets])
    return np.array(numbers)


@pytest.mark.parametrize("law", ["one-sided", "linear"])
@pytest.mark.parametrize("name", ["nrel-5mw", "herringbone", "pitch-drive"])
def test_either_side_may_be_the_input(name, law):
    """The same torques and speeds, given at the other end: the same forces on the same flanks."""
    a = put_together(with_law(name, law))
    first, last = a.case.inputs[0].member, a.case.output.member
    ends = {
        "inputs.0.member": last,
        "inputs.0.speed_rpm": a.flow.speed[last] * 30 / np.pi,
        "inputs.0.power_kw": a.flow.torque[last] * a.flow.speed[last] / 1e3,
        "output.member": first,
    }
    if a.case.inputs[0].power is None:
        del ends["inputs.0.power_kw"]
        ends["inputs.0.torque_nm"] = a.flow.torque[last]
    b = put_together(with_law(name, law, **{k: str(v) for k, v in ends.items()}))
    assert np.array_equal(a.system.pairs.carries, b.system.pairs.carries)
    (angle,) = rated_rotations(a.system, [0.02])
    other = a.system.rolling @ angle
    forces = revolution(a.modal, angle[None], a.system.rated_torque)
    same = revolution(b.modal, (b.system.input_rows @ other)[None], b.system.rated_torque)
    scale = forces.pair_load.max()
    np.testing.assert_allclose(same.pair_load, forces.pair_load, atol=1e-7 * scale)


def test_a_flexible_stage_in_a_train_may_be_driven_backwards(tmp_path):
    """Rated torque of the other sense: positive forces on what then are the carrying flanks."""
    _, bodies = mixed(tmp_path)
    modal = None
    for law in ("one-sided", "linear"):
        keys = {"inputs.0.torque_knm": "-4000", "stages.0.gear_mesh.contact_law": law}
        train = load_case(tmp_path / "train.toml", keys)
        system = build_system(train, bodies)
        modal = modal or modal_system(system, 1000.0)  # the law enters no constant matrix
        model = model_of(train, replace(modal, system=system))
        data = static(model, [0.0])
        ring = data["gear_mesh_force"].values[:, data.kind.values == "ring"].mean()
        assert ring == pytest.approx(-model.flow.stage("first").ring_gear_mesh_force, rel=2e-3)
        assert data["load_sharing"].notnull().all()
        front = system.pairs.carries == 1
        carrying = {x.kind for x, f in zip(system.gear_meshes, front, strict=True) if f}
        assert carrying == {"ring_coast", "sun_coast"}
