"""Every law of force elements: tangents against differences, forces against potentials."""

import numpy as np
import pytest
from law_response import respond

from flexgear.coupling.laws import LAW_NUMBERS, LAWS
from flexgear.coupling.laws.rollers import roller_parameters
from flexgear.model.bearings import Rollers

# parameters and (δ, δ̇) of the rows, each branch of each law
SAMPLES = {
    "linear": ((3e8, 2e4), [((-1e-5,), (1e-3,)), ((2e-5,), (-3e-2,))]),
    "one_sided": (
        (3e8, 2e4, 0.0),
        [((-1e-5,), (0.5,)), ((2e-5,), (-0.5,)), ((2e-5,), (0.1,)), ((2e-5,), (0.5,))],
    ),
    "given_force": ((1.0,), [((1e-5,), (0.1,))]),
    "linear_rate": ((5e3, 20.0, 3.0, -1e9, 1e9), [((1e-5,), (2.5,))]),
    "held_rate": ((5e3, 20.0, 3.0, -1e9, 1e9), [((1e-5,), (2.5,))]),
    "slices": (
        (3, 1e-5, 0.0, -0.2, 0.5, 1.2, 3e8, 4e8, 3e8, 1e-5, 0.0, 2e-5),
        [((3e-5, 1e-5), (0.0, 0.1)), ((5e-5, 4e-5), (9.0, -9.0)), ((-1e-5, -2e-5), (0.1, 0.1))],
    ),
    "coupled_slices": (
        (3, 1e-5, 0.0, -0.2, 0.5, 1.2, 3e8, 4e8, 3e8, 1e-5, 0.0, 2e-5, 2e-10, 2e-10, 2e-10,
         1e7, 1e7, 1e7, 3e-9, 1e-9, 3e-9, 5e-10, 1e-9, 3e-9),
        [((3e-5, 1e-5), (0.0, 0.1)), ((5e-5, 4e-5), (9.0, -9.0)), ((-1e-5, -2e-5), (0.1, 0.1))],
    ),
    "clearance": (
        (5e8, 2e-5),
        [((3e-5, -1e-5), (0.0, 0.0)), ((-1e-5, 5e-5), (0.1, 0.0)), ((1e-5, 5e-6), (0.0, 0.0))],
    ),
}  # fmt: skip
ROLLERS = Rollers(count=17, rows=2, length=0.04, spacing=0.05, clearance=2e-5)
SAMPLES["rollers"] = (
    tuple(roller_parameters(ROLLERS, 1e9, 1e6)),
    [((3e-5, -1e-5, 2e-4, -5e-4), (0.0,) * 4), ((-6e-5, 5e-5, 0.0, 1e-3), (0.1,) * 4)],
)
SAMPLES["journal"] = (  # η, R, L, c, h_min, k; inside the film and where surfaces touch
    (0.03, 0.1, 0.08, 1e-4, 2e-6, 1e9),
    [
        ((5e-5, -2e-5, 4.0), (1e-3, 2e-3, -30.0)),
        ((-8e-5, 5e-5, 0.0), (-2e-2, 0.0, 25.0)),
        ((0.0, 1e-5, 0.0), (1e-4, -1e-3, 40.0)),
        ((9e-5, -5e-5, 0.0), (1e-3, 1e-3, -30.0)),
    ],
)
SAMPLES["dampers"] = (
    (1e4, 1e4, 3e4, 2e2, 2e2, 5.0),
    [((1e-5,) * 6, (0.1, 0.2, 0.0, -1.0, 2.0, 3.0))],
)
CASES = [(law, p, m) for law, (p, motions) in SAMPLES.items() for m in motions]
CASES += [
    (law, (p[0], 0.0, 2e4, *p[3:]), m)  # with the damper that acts always alone
    for law, p, m in CASES
    if law in ("one_sided", "slices", "coupled_slices")
]


def response(law, parameters, motion):
    return respond(LAW_NUMBERS[law], parameters, motion)


@pytest.mark.parametrize(("law", "parameters", "motion"), CASES)
def test_tangents_are_the_differences_of_forces(law, parameters, motion):
    motion = np.array(motion, dtype=float)
    _, _, tangent = response(law, parameters, motion)
    inside = law == "clearance" and np.hypot(*motion[0]) < parameters[1]
    inside |= "slices" in law and motion[0].max() < 0
    for kind, step in ((0, 1e-10), (1, 1e-6)):
        for j in range(motion.shape[1]):
            low, high = motion.copy(), motion.copy()
            low[kind, j] -= step
            high[kind, j] += step
            change = (response(law, parameters, high)[1] - response(law, parameters, low)[1])[0]
            several = law == "rollers" or "slices" in law
            scale = np.abs(tangent).max() if several else max(parameters[0], 1.0)
            if law == "journal":  # forces and a torque: each by itself
                scale = 1e-6 * np.abs(change[j]) / (2 * step)
            if not inside:  # keeps a small tangent there, see the law
                np.testing.assert_allclose(
                    tangent[kind, :, j], change / (2 * step), rtol=2e-4, atol=2e-5 * scale
                )


@pytest.mark.parametrize(("law", "parameters", "motion"), CASES)
def test_elastic_forces_are_gradients_of_the_potential(law, parameters, motion):
    motion = np.array(motion, dtype=float)
    _, force, _ = response(law, parameters, motion)
    for j in range(motion.shape[1]):
        low, high = motion.copy(), motion.copy()
        low[0, j] -= 1e-9
        high[0, j] += 1e-9
        change = response(law, parameters, high)[0] - response(law, parameters, low)[0]
        scale = max(
            np.abs(force).max(),
            0.0 if law == "rollers" or "slices" in law else 1e-5 * parameters[0],
        )
        assert force[1, j] == pytest.approx(change / 2e-9, rel=1e-4, abs=1e-5 * scale)


def test_a_law_that_nobody_named_gives_no_number():
    """Only laws in use are compiled; one that was forgotten must not pass for another."""
    name, parameters, motion = next(case for case in CASES if case[0] == "slices")
    energy, force, tangent = respond(LAW_NUMBERS[name], parameters, motion, used=[])
    assert np.isnan([energy, *force.ravel(), *tangent.ravel()]).all()


def test_every_law_is_sampled_and_has_its_name():
    assert {law.name for law in LAWS} == SAMPLES.keys()
    assert len(LAW_NUMBERS) == len(LAWS)


def test_forces_of_slices_do_not_depend_on_their_start_where_one_just_touches():
    """Two loaded slices bend the tooth under a third, which bears 1e-2 to 1e-13 of their load. The
    forces are those of C f + a f ln(d/f) = x from any start, to rounding: Newton's method for all
    pairs goes round in circles between two forces of one motion."""
    a, d, share = 2e-10, 1e7, np.array([-0.2, 0.5, 1.2])
    bending = np.array([[3e-9, 1e-9, 5e-10], [1e-9, 3e-9, 1e-9], [5e-10, 1e-9, 3e-9]])
    for little in np.logspace(-2, -13, 400):
        forces = np.array([1e4, 1.2e4, 1e4 * little])
        secant = np.log(d / np.maximum(forces, 1e-9 * d))  # the law is linear below 1e-9 d
        overlap = bending @ forces + a * forces * secant
        exact = [(1 - share) @ forces, share @ forces]
        for start in ((0.0, 0.0, 0.0), (1e4, 1.2e4, 2 * forces[2]), (9e3, 1.3e4, forces[2] / 10)):
            of_contact = (3, 0.0, 0.0, *share, 3e8, 4e8, 3e8, *(-overlap), a, a, a, d, d, d)
            parameters = (*of_contact, *bending[np.tril_indices(3)], *start)
            force = response("coupled_slices", parameters, np.zeros((2, 2)))[1][0]
            np.testing.assert_allclose(force, exact, rtol=1e-10)
