"""Frequency responses through the public face: planets, symmetry, transients, what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from dead_zone import case_text

import flexgear
from flexgear.analysis.harmonic_balance import Balance, converge
from flexgear.analysis.orbit import orbit_elements
from flexgear.analysis.orbit_motion import recovery_of
from flexgear.analysis.orbit_receptance import Point, condensed_train
from flexgear.model.errors import InputError
from flexgear.solve.dataset import body_rows

PLANETS = 4
WAVES = {
    "stage.gear_mesh.model": "rectangular",
    "stage.gear_mesh.contact_law": "one-sided",
    "stage.gear_mesh.damping_ratio": "0.08",
    "damping.ratio": "0.02",
}


@pytest.fixture(scope="module")
def planetary():
    """Four equal planets, lumped, planar, with a rectangular wave of stiffness."""
    return flexgear.load_case("lin-parker", WAVES).assemble()


def test_harmonics_excite_only_modes_of_their_nodal_index(planetary):
    """k = l z_s mod N: harmonics of even multiples move central members, others must not."""
    modal = planetary.modal
    teeth = planetary.case.stages[0].sun.teeth
    harmonics = 6
    elements = orbit_elements(modal, 0, 32 * harmonics, True)
    train = condensed_train(elements, harmonics)
    point = Point(1.0, 1.0)
    balance = Balance(elements, train.at(point))
    orbit = converge(balance, point, balance.start())
    names, rows = body_rows(modal.system)
    motion = recovery_of(train, balance, orbit, {}).motion(rows)
    spectrum = np.fft.rfft(motion, axis=0)[1 : harmonics + 1].reshape(harmonics, len(names), 6)
    central = [k for k, name in enumerate(names) if "planet" not in str(name)]
    size = np.abs(spectrum[:, central]).max()
    for order in range(1, harmonics + 1):
        index = order * teeth % PLANETS
        translation = np.abs(spectrum[order - 1, central, :2]).max()
        rotation = np.abs(spectrum[order - 1, central, 5]).max() * 0.1
        if index not in (1, PLANETS - 1):
            assert translation < 1e-8 * size
        if index != 0:
            assert rotation < 1e-8 * size


def test_planetary_states_agree_with_a_transient():
    """Amplitudes of gear-mesh forces after 16 periods, which damp all that is free."""
    frequency = 339.0 + 4.0 / 9.0
    step = 1 / (640 * frequency)
    waves = {**WAVES, "stage.gear_mesh.model": "fourier", "solver.time_step_s": repr(step)}
    waves["solver.output_interval_s"] = repr(10 * step)
    model = flexgear.load_case("lin-parker", waves).assemble()
    at = model.response((0.95, 1.0), harmonics=12).isel(point=-1)
    assert float(at["response_speed_share"]) == pytest.approx(1.0)
    assert float(at["gear_mesh_frequency"]) == pytest.approx(frequency)
    force = model.transient(16 / frequency)["gear_mesh_force"].to_numpy()[-64:]
    spectrum = 2 * np.abs(np.fft.rfft(force, axis=0))[1:7] / 64
    amplitude = at["response_gear_mesh_force_amplitude"].to_numpy().T[:6]
    np.testing.assert_allclose(amplitude, spectrum, rtol=0, atol=3e-3 * spectrum.max())


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    path = tmp_path_factory.mktemp("pair") / "pair.toml"
    path.write_text(case_text(share=0.0, error=0.0))
    return flexgear.load_case(path).assemble()


def test_a_gear_mesh_that_excites_nothing_carries_its_mean_force(pair):
    data = pair.response((0.5, 1.0), harmonics=3)
    force = data["response_gear_mesh_force"]
    np.testing.assert_allclose(force.sel(measure="maximum"), pair.rated[0], rtol=1e-9)
    assert data["stable"].all()
    assert not data["lost_contact_share"].any()
    assert not data.sizes["turning_point"]


@pytest.mark.parametrize(
    ("asked", "problem"),
    [
        ({"speeds": (-0.5, 1.0)}, "goes through zero speed"),
        ({"torques": (0.0, 1.0)}, "goes through zero torque"),
        ({"speeds": (1.0, 1.0)}, "is no range"),
        ({"speeds": (0.5, 1.0), "torques": (0.5, 1.0)}, "beside a range of speeds"),
        ({"torques": (0.5, 1.0), "speed": 0.0}, "is not positive"),
        ({"speeds": (0.5, 1.0), "stage": "stage_9"}, "is not a stage"),
        ({"speeds": (0.5, 1.0), "harmonics": 0}, "is not from 1 to 200"),
    ],
)
def test_what_is_no_range_is_one_line(pair, asked, problem):
    with pytest.raises(InputError, match=problem):
        pair.response(**asked)
