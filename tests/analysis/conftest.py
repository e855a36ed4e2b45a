"""The bundled stage on cheap bodies: everything but the FE reduction."""

import numpy as np
import pytest
from coupled import make_system

from flexgear.coupling.modal import modal_system


@pytest.fixture(scope="session")
def linear():
    """All flexible, linear contact."""
    return make_system(**{"stage.gear_mesh.contact_law": "linear"})


@pytest.fixture(scope="session")
def one_sided():
    """All flexible, one-sided contact with backlash."""
    return make_system(**{"stage.gear_mesh.contact_law": "one-sided"})


@pytest.fixture(scope="session")
def linear_modal(linear):
    return modal_system(linear, 3000.0)


@pytest.fixture(scope="session")
def one_sided_modal(one_sided):
    return modal_system(one_sided, 3000.0)


@pytest.fixture(scope="session")
def angles():
    return np.linspace(0.0, 2 * np.pi / 93, 7)
