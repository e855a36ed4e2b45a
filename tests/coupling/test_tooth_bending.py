"""A stage whose slices bend each other by FE, on coarse segments of one tooth each."""

from dataclasses import replace

import numpy as np
import pytest

import flexgear as fg
from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.line_loads import line_loads
from flexgear.model.load import load_case
from flexgear.results.energy_balance import energy_residual
from flexgear.structures.fe_mesh import SegmentDivisions
from flexgear.structures.tooth_influence import pairs
from flexgear.structures.tooth_influence.of_case import influence_of, influence_parameters

FE = {"gear_mesh.model": "face_load", "gear_mesh.tooth_compliance": "fe"}
BASE = load_case("wind-5mw").with_(**FE)
CYCLE = 2 * np.pi / BASE.view().stage.ring.teeth * np.arange(6) / 6
COARSE = SegmentDivisions(flank=5, fillet=2, tooth=2, layers=8)


@pytest.fixture(scope="module")
def teeth():
    view, found = BASE.view(), {}
    for slot in ("planet", "sun", "ring"):
        own = replace(influence_parameters(view, slot), teeth=1, held_radius=None, margin=0.0)
        own = replace(own, divisions=COARSE)
        found[slot] = influence_of(own, view.material.young_modulus, view.material.poisson_ratio)
    return found


@pytest.fixture
def assembled(monkeypatch, teeth):
    monkeypatch.setattr(pairs, "tooth_influence", lambda view, slot: teeth[slot])
    return lambda **changes: fg.assemble(BASE.with_(**changes), ["all"])


def test_the_equilibrium_closes_and_slices_add_up(assembled):
    model = assembled()
    found = revolution(model.modal, CYCLE, model.system.rated_torque)
    assert found.closure.max() < 1e-8
    slices, largest = line_loads(found), found.pair_load.max()
    total = np.nansum(slices.force, axis=-1)
    np.testing.assert_allclose(total, found.pair_load, atol=1e-7 * largest)
    assert np.nanmin(slices.force) >= 0.0


def test_the_nominal_tangent_is_that_of_lines_that_touch_evenly(assembled):
    """Rows of half the stiffness each, at the radius of gyration: see ``gears.slices.bent``."""
    model = assembled()
    pairs = model.system.pairs
    for table in pairs.slice_table[:2]:
        line = table[len(table) // 2]
        z, k = line[2:17], line[17:32]
        assert (k > 0).all()
        assert 0.2 < line[0] / pairs.half_face[0] < 0.75
        assert k.sum() == pytest.approx(line[1], rel=1e-9)
        # ends of the face are softer than its middle
        assert k[0] < k[len(k) // 2] * 1.3
        assert abs(z).max() < pairs.half_face[0]


def test_half_the_load_is_softer_per_load(assembled):
    """Hertz's line contact is: more than half the deflection remains at half the torque."""
    model = assembled(**{f"errors.{g}_tooth": 0.0 for g in ("ring", "planet", "sun")})
    half, full = (
        fg.static(model, CYCLE, share * model.system.rated_torque).transmission_error
        for share in (0.5, 1.0)
    )
    ratio = (half / full).sel(flank="stage sun 1 drive").mean().item()
    assert 0.5 < ratio < 0.65


def test_a_torque_drop_keeps_its_energy(assembled):
    model = assembled()
    rated, drop = model.system.rated_torque, model.case.drive.drop
    drive = drop(0.2 * rated, 0.005, 0.01, rated)
    run = fg.transient(model, duration=0.03, drive=drive, energy=True)
    assert np.abs(energy_residual(run)).max() < 0.01
