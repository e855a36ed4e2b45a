"""Modes of trains with their energies, and the Campbell diagram."""

import numpy as np
import pytest
from train_contexts import bundled, mixed, one_stage, put_together

from flexgear.analysis.modes import strain_shares
from flexgear.model.load import load_case
from flexgear.results.report.wording import excitation_words
from flexgear.solve.campbell import campbell, crossing_rows, excitations
from flexgear.solve.modes import contributions, mode_rows, modes, top_shares


def strain_energies(springs, natural):
    """Σ φᵀ Rᵀ K R φ over all springs, mode by mode, and the ω² that it has to be."""
    total = sum(
        np.einsum("km,kl,lm->m", rows @ natural.shapes, matrix, rows @ natural.shapes)
        for rows, matrix in springs.values()
    )
    return total, (2 * np.pi * natural.frequencies) ** 2


@pytest.mark.parametrize("name", ["lin-parker", "nrel-5mw", "herringbone", "pitch-drive"])
def test_strain_energies_are_all_there_is(name):
    """Σ φᵀ Rᵀ K R φ over all named springs is ω²: none is left out, none counts twice."""
    model = bundled(name)
    natural, springs = model.natural_modes(), contributions(model, model.mean_springs)
    total, omega2 = strain_energies(springs, natural)
    np.testing.assert_allclose(total, omega2, rtol=1e-7, atol=1e-7 * omega2.max())
    shares = strain_shares(springs, natural.shapes)
    elastic = natural.frequencies > 0
    np.testing.assert_allclose(sum(shares.values())[elastic], 1.0)


@pytest.mark.parametrize("change", [
    {"stage.planet_bearing.clearance_um": "20"},
    {"stage.carrier.support.radial_x_n_per_m": "1e8"},
])  # fmt: skip
def test_strain_energies_of_special_supports(tmp_path, change):
    model = one_stage(tmp_path, planets=3, **change)
    natural, springs = model.natural_modes(), contributions(model, model.mean_springs)
    total, omega2 = strain_energies(springs, natural)
    np.testing.assert_allclose(total, omega2, rtol=1e-7, atol=1e-7 * omega2.max())


def test_kinetic_energies_sum_to_one():
    data = modes(bundled("nrel-5mw"))
    np.testing.assert_allclose(data["kinetic_energy"].sum("inertia"), 1.0)
    np.testing.assert_allclose(data["motion_energy"].sum("motion"), 1.0)


def test_rows_are_what_programs_read():
    rows = mode_rows(modes(bundled("lin-parker"), limit_hz=2000))
    assert set(rows[0]) == {
        "frequency_hz", "type", "multiplicity", "kinetic_energy", "strain_energy", "nodal_index",
    }  # fmt: skip
    assert all(r["frequency_hz"] <= 2000 for r in rows)
    planet = next(r for r in rows if r["type"] == "planet")
    assert top_shares(planet["kinetic_energy"]) == [("stage.planet", pytest.approx(1.0))]
    assert top_shares(planet["strain_energy"])[0][0] == "stage.planet_bearing"


def test_campbell_starts_at_the_modes_at_rest():
    model = bundled("herringbone")
    data = campbell(model, factors=[0.0, 0.5, 1.0])
    rest = modes(model)["frequency"].values
    np.testing.assert_allclose(
        np.sort(data["campbell_frequency"].values[0])[1:], rest[1:], rtol=1e-6
    )
    spread = np.ptp(data["campbell_frequency"].values, axis=0)
    assert spread.max() > 0.1  # gyroscopic terms of the case
    whirl = data["whirl"].values[-1]
    assert np.nanmin(whirl) < -0.5 < 0.5 < np.nanmax(whirl)


def test_crossings_lie_on_mode_and_order():
    model = bundled("nrel-5mw")
    data = campbell(model)
    slope = dict(zip(data["excitation"].values, data["excitation_slope"].values, strict=True))
    assert slope["stage_2 x 3"] == pytest.approx(
        3 * model.flow.stage("stage_2").gear_mesh_frequency
    )
    rows = crossing_rows(data)
    assert rows
    factors, modes_over = data["speed_factor"].values, data["campbell_frequency"].values
    for row in rows:
        line = slope[row["excitation"]] * row["speed_factor"]
        mode = np.interp(row["speed_factor"], factors, modes_over[:, row["mode"] - 1])
        assert row["frequency_hz"] == pytest.approx(line, rel=1e-9)
        assert row["frequency_hz"] == pytest.approx(mode, rel=1e-6)
    assert data.attrs["gyroscopic"] == 0


def test_modes_of_a_train_with_a_flexible_stage(tmp_path):
    """Bodies that bend have energies of their own, and they close with theirs. Planets feel the
    bolts of the ring that bends: planet i at φ_i in the phase N_b φ_i, so in the pattern of k."""
    train, bodies = mixed(tmp_path)
    model = put_together(train, bodies=bodies)
    (bolts,) = (x for x in excitations(model, 1e4) if x.label.kind == "bolt pass")
    rigid = put_together(train, rigid=["first.ring"], bodies=bodies)
    assert "bolt pass" not in {x.label.kind for x in excitations(rigid, 1e4)}
    stage, speed = train.stages[0], model.flow.speed
    number = stage.ring.fe.bolts.number
    assert bolts.label == f"first bolt pass x {number}"
    assert excitation_words(bolts.label) == f"The pass of {number} bolts by planets of first"
    assert bolts.slope == pytest.approx(number * abs(speed["first.carrier"]) / (2 * np.pi))
    phases = np.outer([number, bolts.index], stage.planet_angles)
    assert np.exp(1j * phases[0]) == pytest.approx(np.exp(1j * phases[1]))
    data = modes(model, limit_hz=500)
    kinetic = data["kinetic_energy"]
    assert {"first.ring", "first.sun", "second.gear"} <= set(kinetic.inertia.values)
    np.testing.assert_allclose(kinetic.sum("inertia"), 1.0, rtol=1e-9)
    assert kinetic.sel(inertia="first.ring").max() > 0.5
    for row in mode_rows(data):
        assert sum(row["kinetic_energy"].values()) == pytest.approx(1.0)
    assert {"first.ring", "first.carrier"} <= set(data["spring"].values)
    natural, springs = model.natural_modes(500), contributions(model, model.mean_springs)
    total, omega2 = strain_energies(springs, natural)
    np.testing.assert_allclose(total[1:], omega2[1:], rtol=1e-5)


def test_an_inertia_on_two_ring_halves_couples_no_bodies():
    """Half on each: the energy of every mode has its owner, and rolling the whole inertia."""
    turning = {
        "output.member": "stage.ring",
        "held": '["stage.carrier"]',
        "stage.carrier.support.tangential_n_per_m": "1e9",
        "stage.ring.support.tangential_n_per_m": "0",
    }
    light, heavy = (
        put_together(load_case("herringbone", {**turning, "output.inertia_kg_m2": str(inertia)}))
        for inertia in (0.0, 50.0)
    )
    data = modes(heavy)
    np.testing.assert_allclose(data["kinetic_energy"].sum("inertia"), 1.0)
    rolling = heavy.system.rolling[:, 0]
    added = rolling @ (heavy.system.mass - light.system.mass) @ rolling
    assert added == pytest.approx(50.0 * (heavy.system.ports[-1].row @ rolling) ** 2)
