"""Ring and carrier of the bundled case, reduced end to end on quick meshes."""

import numpy as np
import pytest
from coupled import named
from small_train import SMALL_STAGE

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import power_flow
from flexgear.model.gear_mesh import GearErrors
from flexgear.model.load import load_case
from flexgear.results.stage_part import of_kind, stage_part
from flexgear.solve.model import assemble
from flexgear.solve.static import static
from flexgear.structures.sources.carrier import source as carrier_source
from flexgear.structures.sources.planet import source as planet_source
from flexgear.structures.sources.ring import RingSource
from flexgear.structures.sources.ring import source as ring_source

SOURCES = {"ring": ring_source, "carrier": carrier_source}


@pytest.fixture(scope="module")
def case():
    return load_case(
        "wind-5mw",
        {
            "solver.fidelity": "quick",
            "stage.ring.fe.fixed_interface_modes": "8",
            "stage.carrier.fe.fixed_interface_modes": "120",
        },
    ).view()


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FLEXGEAR_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def ring(case):
    return ring_source(case).reduced()


@pytest.fixture(scope="module")
def carrier(case):
    return carrier_source(case).reduced()


def test_ring_nodes_stand_where_the_conventions_say(case, ring):
    radius = stage_geometry(case).ring.reference_radius
    assert ring.node_names[:2] == ("tooth_001", "tooth_002")
    assert ring.node_names[93:96] == ("fit_1", "fit_2", "bolt_01")
    assert len(ring.node_names) == 120
    angle = 2 * np.pi * 7 / 93
    expected = [radius * np.cos(angle), radius * np.sin(angle), 0.0]
    assert np.allclose(ring.positions[7], expected)
    assert np.allclose(ring.positions[93:95], [[0, 0, -0.185], [0, 0, 0.185]])
    assert np.allclose(ring.positions[95], [0.985, 0.0, -0.215])


def test_carrier_nodes_stand_where_the_conventions_say(case, carrier):
    assert carrier.node_names[:4] == ("drive", "bearing_drive", "bearing_far", "pin_1")
    z = carrier.positions[:3, 2]
    assert z[0] < z[1] < 0 < z[2]
    radius = stage_geometry(case).center_distance
    assert np.allclose(carrier.positions[3], [radius, 0, 0])


@pytest.mark.parametrize("name", ["ring", "carrier"])
def test_rigid_motion_carries_the_mass_and_no_force(request, case, name):
    body = request.getfixturevalue(name)
    fe_mesh = SOURCES[name](case).fe_mesh()
    rigid = body.rigid_modes()
    inertia = rigid.T @ body.mass @ rigid
    assert inertia[0, 0] == pytest.approx(7850 * fe_mesh.volume(), rel=1e-6)
    scale = np.sqrt(np.diag(body.stiffness).max())
    assert np.abs(body.stiffness @ rigid).max() < 1e-8 * scale**2


def test_errors_are_estimated_and_small(ring, carrier):
    assert 0 < ring.report["static_error"] < 0.025  # quick mesh; 0.02 holds at standard
    assert 0 < carrier.report["static_error"] < 0.02
    assert 0 < carrier.report["frequency_error"] < 0.01
    assert ring.report["path"] == "cyclic: 93 sectors, 47 harmonics"
    assert carrier.report["path"] == "cyclic: 5 sectors, 3 harmonics"
    for body in (ring, carrier):
        assert body.report["frequency_limit_hz"] == 2000.0
        assert body.report["frequencies_below_limit"] > 10


@pytest.mark.slow
def test_flank_tie_meets_its_bound(case):
    flank = case.with_(**{"stage.ring.fe.tie": "flank", "stage.ring.fe.fixed_interface_modes": 0})
    assert 0 < ring_source(flank).reduced().report["static_error"] < 0.03


def test_reduced_bodies_come_from_the_cache(case, ring, monkeypatch):
    def refuse(*_args, **_kwargs):
        raise AssertionError("meshed again")

    monkeypatch.setattr(RingSource, "fe_mesh", refuse)
    again = ring_source(case.with_(**{"stage.planet_bearing.radial": 1e9})).reduced()
    assert np.array_equal(again.stiffness, ring.stiffness)
    assert again.report["frequency_error_on_these_supports"]
    assert again.report["static_error"] == ring.report["static_error"]
    softer = ring_source(case.with_(**{"stage.ring.fe.bolts.stiffness_radial": 1e9})).reduced()
    assert not softer.report["frequency_error_on_these_supports"]
    assert 0 < softer.report["static_error"] < ring.report["static_error"]  # more motion
    with pytest.raises(AssertionError, match="meshed again"):
        ring_source(case.with_(**{"stage.ring.fe.rim_thickness": 0.19})).reduced()


def test_a_body_without_a_stated_number_has_as_many_modes_as_the_band_needs(
    case, tmp_path, monkeypatch
):
    """A number that is stated stays, and what it does not answer for is reported; the FE mesh is
    made once for both numbers of modes."""
    bends = case.with_(**{"stage.planet.fe.flexible": True})
    usual = planet_source(bends).reduced()
    limit = 1.3 * usual.report["compared_to_hz"]
    stages = []
    with monkeypatch.context() as patch:
        patch.setenv("FLEXGEAR_CACHE", str(tmp_path))
        enough = planet_source(bends).reduced(lambda stage, _: stages.append(stage), limit)
    assert stages.count("planet: FE mesh") == 1
    assert enough.n_modes > usual.n_modes and enough.report["frequency_limit_hz"] == limit
    assert enough.report["fixed_interface_frequency_max_hz"] > 2 * limit
    compared = {"stage.planet.fe.flexible": "true", "solver.fidelity": "quick"}
    compared["solver.reduction_limit_hz"] = str(1.8 * usual.report["compared_to_hz"])
    stated_limit = planet_source(load_case("wind-5mw", compared).view()).reduced()
    assert stated_limit.n_modes > usual.n_modes  # which are 4 % wrong up to this limit
    assert stated_limit.report["frequency_error"] < 0.02
    stated = bends.with_(**{"stage.planet.fe.fixed_interface_modes": usual.n_modes})
    short = planet_source(stated).reduced(limit_hz=limit)
    assert short.n_modes == usual.n_modes and short.report["frequency_limit_hz"] < limit


@pytest.mark.slow
def test_a_ring_with_more_modes_is_the_ring_of_that_stated_number(monkeypatch):
    case = load_case(SMALL_STAGE, {"solver.fidelity": "quick"}).view()
    monkeypatch.setattr(type(case.ring), "usual_modes", 8)
    left_out = {"stage.ring.fe.fixed_interface_modes": None, "stage.gear_mesh.model": "face_load",
                "stage.ring.fe.tooth_shapes": "always"}  # fmt: skip
    source = ring_source(case.with_(**left_out))
    limit = 1.01 * source.reduced().report["compared_to_hz"]
    enough = source.reduced(limit_hz=limit)
    assert enough.n_modes > 8
    stated = case.with_(**left_out | {"stage.ring.fe.fixed_interface_modes": enough.n_modes})
    same = ring_source(stated).reduced(limit_hz=limit)
    assert np.array_equal(same.stiffness, enough.stiffness)
    assert np.array_equal(same.mass, enough.mass)
    assert same.report["static_error"] == enough.report["static_error"]


def four_planets(case, degrees):
    fewer = {
        "stage.carrier.fe.fixed_interface_modes": 0,
        "solver.cyclic": "auto",
        "stage.planets": 4,
    }
    return case.with_(**fewer, **{"stage.planet_positions": tuple(np.radians(degrees))})


def test_unequal_pins_are_reduced_by_the_general_path(case):
    """Opposite pins of two equal pairs are alike, each in its own axes: K is 2-fold symmetric."""
    unequal = four_planets(case, (0.0, 87.0, 180.0, 267.0))
    body = carrier_source(unequal).reduced()
    assert body.report["path"].startswith("general")
    rigid = body.rigid_modes()
    volume = carrier_source(unequal).fe_mesh().volume()
    assert (rigid.T @ body.mass @ rigid)[0, 0] == pytest.approx(7850 * volume, rel=1e-6)
    half_turn = np.kron(np.eye(7), np.diag([-1.0, -1, 1, -1, -1, 1]))
    pins = np.arange(18, 42).reshape(4, 6)[[2, 3, 0, 1]].ravel()
    order = np.concatenate([np.arange(18), pins])
    turned = (half_turn @ body.stiffness @ half_turn)[np.ix_(order, order)]
    assert np.abs(turned - body.stiffness).max() < 1e-8 * np.abs(body.stiffness).max()


def test_a_stage_with_unequal_planets_is_in_equilibrium(case, ring):
    """Forces take the rated torque; half a turn puts each planet where the opposite one was."""
    unequal = four_planets(case, (0.0, 87.0, 180.0, 267.0)).with_(stage__errors=GearErrors())
    bodies = named(unequal, ring=ring, carrier=carrier_source(unequal).reduced())
    model = assemble(unequal.case, bodies=bodies)
    stage = stage_part(static(model, np.array([0.3, 0.3 + np.pi])), "stage")
    forces = of_kind(stage, "ring").gear_mesh_force.values
    expected = power_flow(unequal.case).stages[0].ring_gear_mesh_force
    assert forces.mean(axis=1) == pytest.approx(expected, rel=1e-6)
    assert forces[1] == pytest.approx(forces[0][[2, 3, 0, 1]], rel=1e-8)
    assert np.ptp(forces[0]) > 1e-4 * expected  # their gear meshes are not in phase
