"""Eq. 23: parts in proportion to stiffness that add up to the gear-mesh force."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from flexgear.results.flanks import stiffness_split

POSITIVE = st.floats(1.0, 1e9)


def test_by_hand():
    np.testing.assert_allclose(
        stiffness_split([[30.0, 60.0, 0.0]], [[1.0, 2.0, 6.0]]), [[10, 20, 60]]
    )


def test_no_pair_no_load():
    assert (stiffness_split(np.zeros((2, 4)), np.zeros((2, 4))) == 0).all()


@given(arrays(float, (3, 4), elements=POSITIVE), arrays(float, (3, 4), elements=POSITIVE))
def test_sum_is_kept_and_split_again_changes_nothing(load, stiffness):
    parts = stiffness_split(load, stiffness)
    np.testing.assert_allclose(parts.sum(-1), load.sum(-1), rtol=1e-12)
    np.testing.assert_allclose(stiffness_split(parts, stiffness), parts, rtol=1e-12)
