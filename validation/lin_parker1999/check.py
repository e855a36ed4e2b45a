"""Lin & Parker's modes: the plain equations by themselves."""

import numpy as np
import pytest

from lin_parker1999 import equations


@pytest.mark.parametrize("planets", [3, 4, 5, 7])
def test_plain_equations_have_one_rigid_rolling_motion(planets: int) -> None:
    """Its ring supported, the train can roll: carrier, sun and planets turn together."""
    mass, stiffness = equations.matrices(planets, equations.Parameters())
    root = np.sqrt(np.diag(mass))
    squares = np.linalg.eigvalsh(stiffness / np.outer(root, root))
    assert np.abs(squares[0]) < 1e-9 * squares[-1] < squares[1]


def test_plain_planet_modes_are_those_of_a_planet_on_its_springs() -> None:
    """3 × 3: gear meshes and bearing of one planet, central members at rest."""
    p = equations.Parameters()
    rows = equations.compressions(0, 4, p.angle)[:, equations.CENTRAL : equations.CENTRAL + 3]
    springs = np.diag([p.gear_mesh, p.gear_mesh, p.bearing, p.bearing])
    m, i = p.planet
    squares = np.linalg.eigvals(np.diag([1 / m, 1 / m, 1 / i]) @ rows.T @ springs @ rows)
    alone = np.sort(np.sqrt(squares.real)) / (2 * np.pi)
    frequencies, shapes = equations.modes(4, p)
    kinds = equations.mode_types(4, p, shapes)
    planet_modes = [f for f, kind in zip(frequencies, kinds, strict=True) if kind == "planet"]
    np.testing.assert_allclose(planet_modes, alone, rtol=1e-9)
