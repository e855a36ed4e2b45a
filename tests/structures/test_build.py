"""Ring and carrier of the bundled case, reduced end to end on quick meshes."""

import numpy as np
import pytest

from flexgear.gears.geometry import stage_geometry
from flexgear.model.case import load_case
from flexgear.model.errors import InputError
from flexgear.structures import build
from flexgear.structures.fe_mesh import carrier_of_case, ring_of_case


@pytest.fixture(scope="module")
def case():
    return load_case(
        "wind-5mw",
        {
            "solver.fidelity": "quick",
            "ring.fixed_interface_modes": "8",
            "carrier.fixed_interface_modes": "120",
        },
    )


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FLEXGEAR_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def ring(case):
    return build.ring_body(case)


@pytest.fixture(scope="module")
def carrier(case):
    return build.carrier_body(case)


def test_ring_nodes_stand_where_the_conventions_say(case, ring):
    radius = stage_geometry(case.stage).ring.reference_radius
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
    radius = stage_geometry(case.stage).center_distance
    assert np.allclose(carrier.positions[3], [radius, 0, 0])


@pytest.mark.parametrize("name", ["ring", "carrier"])
def test_rigid_motion_carries_the_mass_and_no_force(request, case, name):
    body = request.getfixturevalue(name)
    fe_mesh = {"ring": ring_of_case, "carrier": carrier_of_case}[name](case)
    rigid = body.rigid_modes()
    inertia = rigid.T @ body.mass @ rigid
    assert inertia[0, 0] == pytest.approx(7850 * fe_mesh.volume(), rel=1e-6)
    scale = np.sqrt(np.diag(body.stiffness).max())
    assert np.abs(body.stiffness @ rigid).max() < 1e-8 * scale**2


def test_bodies_that_repeat_are_reduced_by_sectors_unless_that_is_off(case, ring, carrier):
    assert ring.report["path"] == "cyclic: 93 sectors, 47 harmonics"
    assert carrier.report["path"] == "cyclic: 5 sectors, 3 harmonics"
    small = {"ring.fixed_interface_modes": 0, "carrier.fixed_interface_modes": 0}
    whole = build.carrier_body(case.with_(**small, **{"solver.cyclic": "off"}))
    assert whole.report["path"] == "general: sectors not asked for"
    b = carrier.interface_dofs
    scale = np.sqrt(np.diag(whole.stiffness))
    difference = (carrier.stiffness[:b, :b] - whole.stiffness) / scale / scale[:, None]
    assert np.abs(difference).max() < 1e-8


def test_errors_are_estimated_and_small(ring, carrier):
    assert 0 < ring.report["static_error"] < 0.025  # quick mesh; 0.02 holds at standard
    assert 0 < carrier.report["static_error"] < 0.02
    assert 0 < carrier.report["frequency_error"] < 0.01
    for body in (ring, carrier):
        assert body.report["frequency_limit_hz"] == 2000.0
        assert body.report["frequencies_below_limit"] > 10


def test_flank_tie_meets_its_bound(case):
    flank = case.with_(**{"ring.tie": "flank", "ring.fixed_interface_modes": 0})
    assert 0 < build.ring_body(flank).report["static_error"] < 0.03


def test_reduced_bodies_come_from_the_cache(case, ring, monkeypatch):
    def refuse(*_args, **_kwargs):
        raise AssertionError("meshed again")

    monkeypatch.setattr(build, "ring_of_case", refuse)
    again = build.ring_body(case.with_(**{"bearings.planet.radial": 1e9}))
    assert np.array_equal(again.stiffness, ring.stiffness)
    assert again.report["frequency_error_on_these_supports"]
    assert again.report["static_error"] == ring.report["static_error"]
    softer = build.ring_body(case.with_(**{"ring.bolts.stiffness_radial": 1e9}))
    assert not softer.report["frequency_error_on_these_supports"]
    assert 0 < softer.report["static_error"] < ring.report["static_error"]  # more motion
    with pytest.raises(AssertionError, match="meshed again"):
        build.ring_body(case.with_(**{"ring.rim_thickness": 0.19}))


def test_unequal_pins_want_a_mesh_of_their_own(case):
    angles = (0.0, 1.2, 2.5, 3.8, 5.0)
    with pytest.raises(InputError, match="equally spaced"):
        carrier_of_case(case.with_(**{"stage.planet_positions": angles}))
