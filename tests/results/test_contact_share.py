"""Share of time with n pairs, counted and expected."""

import numpy as np
import pytest

from flexgear.results.flanks import contact_share, expected_contact_share


def test_counts():
    tooth = np.array([[[1, 2, 0], [3, 0, 0]], [[1, 2, 9], [3, 4, 0]]])
    assert contact_share(tooth > 0) == {1: 0.25, 2: 0.5, 3: 0.25}


def test_nothing_sampled():
    assert contact_share(np.zeros((0, 5, 4), dtype=bool)) == {}


def test_expected():
    assert expected_contact_share(2.25) == pytest.approx({2: 0.75, 3: 0.25})
    assert expected_contact_share(2.0) == {2: 1.0}


@pytest.mark.parametrize("ratio", [1.4, 2.0, 2.37, 2.9])
def test_counted_pairs_on_a_path_equal_the_expected_share(ratio):
    s = np.linspace(0, 1, 20001)[:-1]
    pairs = s[:, None] + np.arange(5)  # positions in base pitches
    share, expected = contact_share(pairs < ratio), expected_contact_share(ratio)
    assert set(share) == set(expected)
    for n in share:
        assert abs(share[n] - expected[n]) < 1e-4
    assert sum(n * v for n, v in share.items()) == pytest.approx(ratio, abs=1e-4)
