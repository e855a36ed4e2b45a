"""What tests of structures share."""

import pytest

from flexgear.structures.linalg.dense import single_threaded_blas


@pytest.fixture(scope="module")
def one_thread():
    """Dense reference solutions on a busy machine: threads of BLAS would wait for each other."""
    with single_threaded_blas():
        yield
