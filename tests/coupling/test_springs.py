"""Springs of the coupled system are those on which the reduction's errors are estimated."""

import numpy as np
import pytest
from coupled import make_bodies, make_case, named, stage_system

from flexgear.coupling.springs import invariant_part
from flexgear.structures.sources.of_case import carrier_source, ring_source

STIFFNESS = {  # no two alike
    "stage.ring.fe.bolts.stiffness_radial_n_per_m": "1.1e9",
    "stage.ring.fe.bolts.stiffness_tangential_n_per_m": "1.2e9",
    "stage.ring.fe.bolts.stiffness_axial_n_per_m": "1.3e9",
    "stage.ring.fe.bolts.stiffness_tilt_nm_per_rad": "1.4e7",
    "stage.ring.fe.bolts.stiffness_twist_nm_per_rad": "1.5e6",
    "stage.ring.fe.bolts.first_angle_deg": "5",
    "stage.ring.fe.fits.0.stiffness_radial_n_per_m": "1.6e9",
    "stage.ring.fe.fits.0.stiffness_axial_n_per_m": "1.7e8",
    "stage.ring.fe.fits.1.stiffness_tilt_nm_per_rad": "1.8e7",
    "stage.carrier.bearing_far.radial_x_n_per_m": "1.9e9",
    "stage.carrier.bearing_far.radial_y_n_per_m": "2.1e9",
    "stage.carrier.bearing_drive.axial_n_per_m": "2.2e9",
}


@pytest.fixture(scope="module")
def stage():
    case = make_case(**STIFFNESS)
    ring, carrier = make_bodies(case).values()
    return case, ring, carrier, stage_system(case, named(case, ring=ring, carrier=carrier))


def test_ring(stage):
    case, ring, _, system = stage
    own = system.slice_of("stage.ring")
    coupled = system.stiffness[own, own] - ring.stiffness
    estimated = ring_source(case).supports(ring.node_names, ring.stiffness)
    assert np.abs(coupled - estimated).max() < 1e-9 * np.abs(estimated).max()
    nodes = np.abs(estimated).max(axis=1).reshape(-1, 6).max(axis=1) > 0
    assert nodes.sum() == case.ring.bolts.number + len(case.ring.fits)


def test_carrier(stage):
    """The system holds the mean of bearings over a turn, and turns the rest."""
    case, _, carrier, system = stage
    own = system.slice_of("stage.carrier")
    coupled = system.stiffness[own, own] - carrier.stiffness
    still = np.zeros_like(carrier.stiffness)
    estimated = carrier_source(case).supports(carrier.node_names, still)
    for name in ("bearing_drive", "bearing_far"):
        at = 6 * carrier.node_names.index(name) + np.arange(6)
        at = np.ix_(at, at)
        mean = invariant_part(estimated[at])
        assert np.abs(mean).max() > 0
        assert np.abs(coupled[at] - mean).max() < 1e-9 * np.abs(mean).max()
