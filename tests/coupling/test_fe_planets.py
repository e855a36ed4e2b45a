"""Planets as FE bodies in the coupled system: their teeth turn past the gear meshes.

The body is one of beams (``beam_planet``): the same from tooth to tooth, and of any stiffness.
"""

import numpy as np
import pytest
from beam_planet import beam_planet
from coupled import make_bodies, make_case
from heavy_stage import SMALL

from flexgear.analysis import step_space
from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.kernels.eliminated_springs import no_springs
from flexgear.analysis.kernels.energy import LEFT_OVER
from flexgear.analysis.orbit import orbit_elements
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system, static_system
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import power_flow
from flexgear.model.names import BodyName
from flexgear.solve.model import model_of
from flexgear.solve.static import static
from flexgear.solve.transient import simulate
from flexgear.structures.bodies import rigid_variant

PLANETS = {"stage.planet.fe.tie": "root"}
TORQUE = 4e6
SPEED_GIVEN = {
    "output.machine.law": "torque",
    "inputs.0.machine.law": "speed",
    "drive.steps.torques_nm": [],
}
ROLLERS = {"count": 18, "rows": 2, "length_mm": 120, "spacing_mm": 150, "clearance_um": 40}


def coupled(stiffer=1.0, rigid=("ring", "carrier"), **keys):
    """The system of the stage with planets of beams, and its case."""
    few_teeth = {key: value for key, value in SMALL.items() if not key.endswith("_law")}
    view = make_case(**PLANETS, **few_teeth, **keys)
    g = stage_geometry(view)
    body = beam_planet(g.planet.teeth, 0.9 * g.planet.root_radius, young=2.06e12 * stiffer)
    bodies = {**make_bodies(view), BodyName.of(view.name, "planet"): body}
    parts = {
        name: rigid_variant(body.as_body()) if name.part in rigid else body
        for name, body in bodies.items()
    }
    return build_system(view.case, parts, [name for name in bodies if name.part in rigid]), view


def of_bearing(rollers):
    """Keys of the planets' bearing."""
    return {f"stage.planet_bearing.rollers.{k}": v for k, v in (rollers or {}).items()}


def equilibria(system, cycles=1):
    """At three places of some gear-mesh cycles."""
    pairs, places = system.pairs, np.array([0.0, 0.3, 0.7])
    cycle = abs(pairs.pitch[0] / pairs.rate[0])
    theta = cycle * np.concatenate([places + k for k in range(cycles)])
    angles = np.zeros((len(theta), len(system.input_rows)))
    angles[:, 0] = theta / (system.angles[pairs.angle[0]] @ system.rolling)[0]
    return revolution(static_system(system), angles, TORQUE)


@pytest.mark.parametrize("rollers", [None, ROLLERS])
def test_stiff_planets_carry_as_lumped_ones(rollers):
    lumped, stiff, soft = (
        equilibria(coupled(**k, **of_bearing(rollers))[0])
        for k in ({"rigid": ("ring", "carrier", "planet")}, {"stiffer": 1e7}, {})
    )
    scale = lumped.pair_load.max()
    np.testing.assert_allclose(stiff.pair_load, lumped.pair_load, atol=1e-6 * scale)
    assert np.abs(soft.pair_load - lumped.pair_load).max() > 0.01 * scale
    assert soft.closure.max() < 1e-8


def test_every_gear_mesh_cycle_is_like_the_first_though_other_teeth_of_the_planets_mesh():
    result = equilibria(coupled()[0], cycles=4)
    first, *others = np.split(result.pair_load, 4)
    for other in others:
        # pairs change places with every cycle
        np.testing.assert_allclose(
            np.sort(other, axis=2), np.sort(first, axis=2), atol=1e-8 * first.max()
        )
    teeth = [set(t[t >= 0].tolist()) for t in np.split(result.pair_tooth, 4)]
    assert teeth[0] != teeth[1]


@pytest.mark.parametrize("model", ["per_pair", "face_load"])
def test_sun_and_ring_hold_the_balance_on_fe_planets(model):
    system, view = coupled(**{"stage.gear_mesh.model": model})
    force = static(model_of(view.case, system), [0.0, 0.4]).gear_mesh_force.values
    ring, sun = (
        force[:, : view.stage.planets],
        force[:, view.stage.planets : 2 * view.stage.planets],
    )
    np.testing.assert_allclose(ring, sun, rtol=1e-9)


def test_misalignment_by_bodies_adds_up_to_the_whole():
    """The carrier, the bearings and the teeth of the planets tilt; no stage here has a "gear"."""
    system, view = coupled(rigid=("ring",), **{"stage.gear_mesh.model": "face_load"})
    data = static(model_of(view.case, system), [0.0, 0.4])
    whole, shares = data.gear_mesh_misalignment, data.gear_mesh_misalignment_by_cause
    loaded = shares.flank_sense == "drive"
    scale = float(np.abs(whole).max())
    np.testing.assert_allclose(shares.sum("cause")[:, loaded], whole[:, loaded], atol=1e-8 * scale)
    largest = np.abs(shares[:, loaded]).max(["position", "flank"])
    assert (largest.sel(cause=["carrier", "planet bearing", "planet"]) > 0.01 * scale).all()
    assert largest.sel(cause="gear") == 0.0


@pytest.mark.parametrize("stiffness", [1e9, 1e13])
def test_forces_of_bearings_of_any_stiffness_pass_the_torque_to_the_carrier(stiffness):
    """A constant spring beside a bearing that is stiffer than the bore takes none of it."""
    system, view = coupled(
        **{
            "stage.planet_bearing.radial_n_per_m": stiffness,
            "stage.planet_bearing.axial_n_per_m": stiffness,
            "stage.planet_bearing.tilt_nm_per_rad": stiffness / 100,
        }
    )
    data = static(model_of(view.case, system), [0.0, 0.4])
    arm = stage_geometry(view).center_distance
    torque = arm * data.planet_bearing_force.values[:, :, 1].sum(axis=1)
    rated = power_flow(view.case).torque[f"{view.name}.carrier"]
    np.testing.assert_allclose(np.abs(torque), abs(rated), rtol=1e-6)


@pytest.mark.parametrize("rollers", [None, ROLLERS])
def test_the_energy_of_a_transient_closes(rollers):
    system, view = coupled(**of_bearing(rollers))
    run = simulate(model_of(view.case, system), duration=0.01, energy=True)
    data = run.data
    left = sum(sign * data[f"energy_{name}"] for name, sign in LEFT_OVER.items())
    work = float(np.abs(data.energy_input_work).max())
    assert float(np.abs(left - left[0]).max()) < 1e-6 * work


@pytest.mark.parametrize("keys", [{}, SPEED_GIVEN])
def test_springs_that_are_eliminated_carry_what_they_do_as_rows(monkeypatch, keys):
    """The machine of a stated speed is a row that is held, also in steps of no duration."""
    system, view = coupled(rigid=("ring",), **keys)
    model = model_of(view.case, system)

    def as_rows(pairs, channels, ports):
        return no_springs(len(channels.displacement), ports + 2 * len(pairs.s0) + 1)

    step = step_space.step_data(model.modal, 1e-4)
    assert len(step.springs.stiffness) == len(system.pairs.support_stiffness) > 0
    eliminated = simulate(model, duration=0.01, energy=True).data
    monkeypatch.setattr(step_space, "eliminated_springs", as_rows)
    rows = simulate(model, duration=0.01, energy=True).data
    for name, values in eliminated.data_vars.items():
        scale = float(np.abs(rows[name]).max())
        np.testing.assert_allclose(values, rows[name], atol=1e-8 * scale, err_msg=name)


def test_springs_whose_receptance_changes_with_the_angle_stay_rows():
    """As of pins whose frames turned: they are stiffer along the carrier's radius than across."""
    system, view = coupled()
    blocks = system.pairs.support_block
    turned = system.pairs._replace(support_angle=np.where(blocks == blocks[0, 0], 1, -1))
    system = system.with_(pairs=turned)
    step = step_space.step_data(model_of(view.case, system).modal, 1e-4)
    assert len(step.springs.stiffness) == 0


def test_steady_states_take_bearings_whose_rings_turn_alike_but_for_rounding():
    """Joints between stages leave it in the rotations; a bearing that depends on a shaft's speed
    is refused, and was taken to be there."""
    system, _ = coupled()
    noise = 1e-15 * np.abs(system.rolling).max() * np.random.default_rng(1).random(system.size)
    turning = system.with_(rolling=system.rolling + noise[:, None])
    elements, rounded = (orbit_elements(modal_system(s), 0, 32) for s in (system, turning))
    np.testing.assert_allclose(rounded.offset, elements.offset, rtol=0, atol=1e-12)
