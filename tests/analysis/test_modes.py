"""Modes up to a limit; types, multiplicities and energies of stages whose modes are known."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lumped_stage import SPATIAL, lin_parker
from scipy import linalg

from flexgear.analysis.modes import (
    PARTS,
    classify,
    modes,
    planar_rows,
    springs_at,
    strain_shares,
)
from flexgear.model.errors import FlexgearError
from flexgear.model.names import BodyName
from flexgear.structures.bodies import lumped_body
from flexgear.structures.shaft import BeamSection, shaft_body


@pytest.fixture(scope="module")
def every(linear):
    return modes(linear, springs_at(linear, 0.3).stiffness)


@pytest.mark.parametrize("limit", [1e-3, 5.0, 300.0, 2000.0])
def test_modes_up_to_a_limit_are_the_lowest_of_all(linear, every, limit):
    some = modes(linear, springs_at(linear, 0.3).stiffness, limit)
    n = int(np.sum(every.frequencies <= limit))
    assert len(some.frequencies) == n >= 1
    assert some.frequencies[0] == 0.0
    np.testing.assert_allclose(some.frequencies, every.frequencies[:n], rtol=1e-7)
    gram = some.shapes.T @ linear.mass @ some.shapes
    np.testing.assert_allclose(gram, np.eye(n), atol=1e-10)
    np.testing.assert_allclose(np.sum(list(some.energy.values()), axis=0), 1.0, atol=1e-10)


def test_shapes_solve_the_coupled_system(linear):
    contact = springs_at(linear, 0.3).stiffness
    natural = modes(linear, contact, limit_hz=1000.0)
    k = linear.stiffness + contact
    force = linear.mass @ natural.shapes * (2 * np.pi * natural.frequencies) ** 2
    left = linalg.norm(k @ natural.shapes - force, axis=0)
    assert left.max() < 1e-8 * np.abs(k).max() * np.abs(natural.shapes).max()


# Lin & Parker 1999, J. Vib. Acoust. 121:316, as printed (rounded)
PRINTED = {
    3: {
        "rotational": [1475.7, 1930.3, 2658.3, 7462.8, 11775.3],
        "translational": [743.2, 1102.4, 1896.0, 2276.4, 6986.3, 9647.9],
        "planet": [],
    },
    4: {
        "rotational": [1536.6, 1970.6, 2625.7, 7773.6, 13071.1],
        "translational": [727.0, 1091.0, 1892.8, 2342.5, 7189.9, 10437.6],
        "planet": [1808.2, 5963.8, 6981.7],
    },
}


def types(stage, rigid=None):
    f, shapes = stage.modes()
    rigid = rigid_motions(f) if rigid is None else rigid
    return f, classify(f, shapes, stage.mass, stage.bodies, rigid=rigid)


def rigid_motions(f):
    return int(np.sum(f <= 1e-6 * f.max()))


@pytest.mark.parametrize("planets", [3, 4])
def test_lin_parker_frequencies_types_and_multiplicities(planets):
    f, t = types(lin_parker(planets))
    for kind, printed in PRINTED[planets].items():
        times = 2 if kind == "translational" else 1
        mine = [x for x, k in zip(f, t.kinds, strict=True) if k == kind]
        np.testing.assert_allclose(mine, np.repeat(printed, times), rtol=5e-4)
        assert all(m == times for m, k in zip(t.multiplicity, t.kinds, strict=True) if k == kind)
    assert t.kinds.count("rigid") == 1 and t.kinds[0] == "rigid"


@pytest.mark.parametrize("planets", [3, 4, 5, 6, 7])
def test_counts_for_any_number_of_planets(planets):
    """6 rotational (one rigid), 6 pairs translational, 3 planet modes of multiplicity N − 3."""
    _, t = types(lin_parker(planets))
    count = Counter(t.kinds)
    assert count["rotational"] == 5 and count["rigid"] == 1
    assert count["translational"] == 12
    assert count["planet"] == 3 * (planets - 3)
    planet = [m for m, k in zip(t.multiplicity, t.kinds, strict=True) if k == "planet"]
    assert planet == [planets - 3] * len(planet)


def test_diametrically_opposed_planets_need_not_be_equally_spaced():
    """Lin & Parker 2000: the three types stay; translational pairs split into single modes."""
    a = np.radians(70.0)
    _, t = types(lin_parker(4, angles=[0.0, a, np.pi, np.pi + a]))
    count = Counter(t.kinds)
    assert count["rotational"] == 5 and count["translational"] == 12 and count["planet"] == 3
    assert all(m == 1 for m, k in zip(t.multiplicity, t.kinds, strict=True))


def test_uneven_spacing_mixes_types_and_says_shares():
    _, t = types(lin_parker(3, angles=np.radians([0.0, 100.0, 240.0])))
    at = [i for i, k in enumerate(t.kinds) if k == "mixed"]
    assert at
    for i in at:
        central = sum(t.shares[p][i] for p in PARTS[:-1])
        assert t.shares["rotational"][i] > 1e-3 * central
        assert t.shares["translational"][i] > 1e-3 * central
        assert max(PARTS[:-1], key=lambda p: t.shares[p][i]) in ("rotational", "translational")


def test_helical_gears_couple_rotation_with_axial_and_translation_with_tilting():
    """Eritenel & Parker 2009: 12 rotational-axial, 12 pairs, 6 planet modes N − 3 fold."""
    _, t = types(lin_parker(5, dofs=SPATIAL, helix=0.3))
    count = Counter(t.kinds)
    assert count == {
        "rigid": 1, "rotational-axial": 11, "translational-tilting": 24, "planet": 12,
    }  # fmt: skip


def test_spatial_modes_of_spur_gears_are_the_planar_ones_and_others():
    f, t = types(lin_parker(4, dofs=SPATIAL))
    planar, p = types(lin_parker(4))
    for kind in ("rotational", "translational"):
        mine = [x for x, k in zip(f, t.kinds, strict=True) if k == kind]
        theirs = [x for x, k in zip(planar, p.kinds, strict=True) if k == kind]
        np.testing.assert_allclose(mine, theirs, rtol=1e-9)
    assert t.kinds.count("axial") == 4 and t.kinds.count("tilting") == 10


def accidental():
    """Two independent stages; the second so stiff that it shares a frequency with the first."""
    a, b = lin_parker(4), lin_parker(3)
    (fa, ta), (fb, tb) = types(a), types(b)
    i = ta.kinds.index("planet")
    j = tb.kinds.index("rotational")
    scale = (fa[i] / fb[j]) ** 2
    mass = linalg.block_diag(a.mass, b.mass)
    stiffness = linalg.block_diag(a.stiffness, scale * b.stiffness)
    second = tuple(
        replace(body, name=BodyName.of("second", body.name.part, body.name.planet))
        for body in b.bodies
    )
    return a.bodies + second, mass, stiffness, fa[i]


def test_accidentally_equal_frequencies_are_turned_apart():
    bodies, mass, stiffness, f0 = accidental()
    values, shapes = linalg.eigh(stiffness, mass)
    f = np.sqrt(np.clip(values, 0, None)) / (2 * np.pi)
    at = np.flatnonzero(np.abs(f / f0 - 1) < 1e-6)
    assert len(at) == 2
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    shapes[:, at] = shapes[:, at] @ turn  # what an eigenvalue solver is free to return
    t = classify(f, shapes, mass, bodies, rigid=rigid_motions(f))
    assert sorted(t.kinds[i] for i in at) == ["planet", "rotational"]
    assert [int(t.multiplicity[i]) for i in at] == [1, 1]
    gram = t.shapes.T @ mass @ t.shapes
    np.testing.assert_allclose(gram, np.eye(len(f)), atol=1e-9)
    left = stiffness @ t.shapes - mass @ t.shapes * values
    assert np.abs(left).max() < 1e-6 * np.abs(stiffness).max() * np.abs(t.shapes).max()


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_any_basis_of_rotational_and_translational_modes_is_separated(seed):
    """A rotational mode and a translational pair of one frequency, turned at random."""
    stage = lin_parker(3)
    _, shapes = stage.modes()
    _, t = types(stage)
    pick = [
        t.kinds.index("rotational"),
        *[i for i, k in enumerate(t.kinds) if k[:5] == "trans"][:2],
    ]
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    mixed = shapes[:, pick] @ turn
    got = classify(np.full(3, 500.0), mixed, stage.mass, stage.bodies, rigid=0)
    assert Counter(got.kinds) == {"rotational": 1, "translational": 2}
    np.testing.assert_allclose(got.shapes.T @ stage.mass @ got.shapes, np.eye(3), atol=1e-9)


def test_energy_sums_to_one_over_parts_and_over_bodies():
    for stage in (lin_parker(4), lin_parker(3, dofs=SPATIAL, helix=0.2)):
        _, t = types(stage)
        np.testing.assert_allclose(np.sum(list(t.shares.values()), axis=0), 1.0, atol=1e-9)
        np.testing.assert_allclose(np.sum(list(t.bodies.values()), axis=0), 1.0, atol=1e-9)


def test_strain_energy_sums_to_one_and_finds_the_spring():
    stage = lin_parker(4)
    _, shapes = stage.modes()
    springs = dict(stage.springs)
    for i in range(4):
        springs[f"ring_{i + 1}"] = stage.rows[i : i + 1], np.diag([5e8])
        springs[f"sun_{i + 1}"] = stage.rows[4 + i : 5 + i], np.diag([5e8])
    shares = strain_shares(springs, shapes)
    total = np.sum(list(shares.values()), axis=0)
    assert total[0] == 0.0  # rolling strains nothing
    np.testing.assert_allclose(total[1:], 1.0, rtol=1e-9)
    values = np.diag(shapes.T @ stage.stiffness @ shapes)
    # sensitivity: dω²/ω² = share · dk/k
    springs["sun_1"] = stage.rows[4:5], np.diag([5e8 * 1e-4])
    change = np.diag(shapes.T @ (stage.rows[4:5].T @ stage.rows[4:5]) @ shapes) * 5e8
    np.testing.assert_allclose(shares["sun_1"][1:], (change / values)[1:], atol=1e-9)


@pytest.fixture
def beam():
    return shaft_body(
        [BeamSection(0.5, 0.1, 0.0)], young=2e11, poisson=0.3, density=7850, direction=1.0,
        elements_per_section=4, end_masses={},
    )  # fmt: skip


def test_rigid_motions_of_a_beam_leave_no_deformation(beam):
    """Rigid motion of a beam is translation and rotation about its centre of mass; bending is
    deformation."""
    values, shapes = linalg.eigh(beam.stiffness, beam.mass)
    f = np.sqrt(np.clip(values, 0, None))
    t = classify(f, shapes, beam.mass, [beam], rigid=6)
    assert np.abs(t.shares["elastic"][:6]).max() < 1e-6
    np.testing.assert_allclose(t.shares["elastic"][6:], 1.0, atol=1e-6)
    assert set(t.kinds[6:]) == {"elastic"}


def test_slight_deformation_of_a_member_does_not_hide_its_type(beam):
    """A beam on soft end springs bounces: translation with a little bending, its rigid shape."""
    ends = np.vstack([beam.node(beam.node_names[i])[:3] for i in (0, -1)])
    held = beam.stiffness + 2e6 * ends.T @ ends
    held += 1e9 * beam.node(beam.node_names[0])[5:].T @ beam.node(beam.node_names[0])[5:]
    values, shapes = linalg.eigh(held, beam.mass)
    t = classify(np.sqrt(values), shapes, beam.mass, [beam], rigid=0)
    assert t.kinds[:3] in (
        ("translational", "translational", "axial"), ("axial", "translational", "translational"),
    )  # fmt: skip
    bounce = t.kinds.index("translational")
    assert 1e-9 < t.shares["elastic"][bounce] < 0.5


def test_a_body_without_coordinates_is_no_member():
    stage = lin_parker(3)
    f, shapes = stage.modes()
    held = lumped_body(BodyName.of("", "held"), 1.0, (1.0, 1.0, 1.0), "fixed")
    t = classify(f, shapes, stage.mass, [held, *stage.bodies], rigid=rigid_motions(f))
    assert list(t.bodies) == [body.name for body in stage.bodies]


def test_planar_rows_are_mean_motions_with_masses():
    stage = lin_parker(3)
    rows, masses = planar_rows(stage.mass, stage.bodies)
    assert rows.shape == (3, 2, 18)
    np.testing.assert_allclose(masses, [0.4, 2.35, 5.43])
    np.testing.assert_allclose(rows[1] @ np.eye(18)[:, 3:5], np.eye(2))


def test_mass_that_couples_bodies_is_refused():
    stage = lin_parker(3)
    mass = stage.mass.copy()
    mass[0, 3] = mass[3, 0] = 0.2
    values, shapes = linalg.eigh(stage.stiffness, mass)
    with pytest.raises(FlexgearError, match="couples bodies"):
        classify(np.sqrt(np.abs(values)), shapes, mass, stage.bodies, rigid=1)
