"""Load sharing factor and spread against sums done by hand."""

import numpy as np

from flexgear.results.load_sharing import load_sharing, planet_force_spread


def test_equal_loads_share_evenly():
    assert load_sharing([[3.0] * 5], 3.0) == 1.0


def test_by_hand():
    k = load_sharing([[1.0, 2.0, 3.0], [4.0, 4.0, 1.0]], 2.0)
    np.testing.assert_allclose(k, [3 * 3 / 6, 3 * 4 / 9])


def test_one_planet_takes_all_gives_number_of_planets():
    assert load_sharing([[10.0, 0, 0, 0]], 2.0)[0] == 4.0


def test_not_evaluated_below_three_percent_of_rated_sum():
    rated, planets = 100.0, 4
    total = np.array([0.0299, 0.0301]) * rated * planets
    k = load_sharing(total[:, None] * np.array([0.4, 0.3, 0.2, 0.1]), rated)
    assert np.isnan(k[0])
    np.testing.assert_allclose(k[1], 1.6)


def test_through_zero_is_not_a_number_and_warns_of_nothing():
    with np.errstate(all="raise"):
        assert np.isnan(load_sharing([[1.0, -1.0]], 5.0)).all()


def test_reversed_torque_mirrors():
    f = np.array([[5.0, 7.0, 6.0]])
    np.testing.assert_allclose(load_sharing(-f, 6.0), load_sharing(f, 6.0))


def test_spread():
    np.testing.assert_allclose(planet_force_spread([[1.0, 4.0], [-2.0, 2.0]], 2.0), [1.5, 2.0])
