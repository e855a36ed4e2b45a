"""Load along the face: closed forms of tilt and crowning, slices that bend each other."""

from dataclasses import fields
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from law_response import respond
from scipy.optimize import brentq, nnls
from train_contexts import rigid_stage

from flexgear.analysis import equilibrium
from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.line_loads import interpolated, line_loads
from flexgear.coupling.laws import COUPLED_SLICES_LAW, SLICES_LAW, functions
from flexgear.coupling.pair_data import LINE_COLUMNS
from flexgear.gears.slices import Line, cut, factor_along, mean_along, with_ends
from flexgear.model.errors import FlexgearError
from flexgear.model.load import load_case
from flexgear.solve.static import static
from flexgear.solve.transient import simulate

FACE, STIFFNESS, LOAD = 0.1, 15e9, 3e5  # m, N/m², N/m


def pair(count, gap):
    """Parameters of a spur pair whose stiffness is the same all along the face; gap(z) m."""
    line = Line((0.0, 1.0), (0.0, 1.0), 0.0, FACE / 2)
    every = cut(lambda xi: np.full_like(xi, STIFFNESS), line, count, lambda _, z: gap(z))
    middle = len(every.s) // 2
    arrays = {
        f.name: v[middle]
        for f in fields(every)
        if isinstance(v := getattr(every, f.name), np.ndarray)
    }
    slices = SimpleNamespace(**arrays)
    share = 0.5 * (1 + slices.z / slices.radius)
    fixed = [count, 0.0, 0.0]
    return np.concatenate([fixed, share, slices.stiffness, slices.gap]), slices


def factor(count, gap):
    """K_Hβ of rigid bodies that approach in parallel under the mean line load."""
    parameters, slices = pair(count, gap)

    def forces(delta):
        return slices.stiffness * np.maximum(delta - slices.gap, 0.0)

    def force(delta):
        return respond(SLICES_LAW, parameters, np.array([[delta] * 2, [0.0] * 2]))[1][0].sum()

    delta = brentq(lambda d: force(d) - LOAD * FACE, 0.0, 1.0, xtol=1e-18, rtol=1e-14)
    assert force(delta) == pytest.approx(forces(delta).sum(), rel=1e-12)
    load = forces(delta) / slices.width
    return float(with_ends(load).max() / load.mean())


def tilted(f):
    return lambda z: f * (z / FACE + 0.5)


def crowned(c):
    return lambda z: c * (2 * z / FACE) ** 2


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7, 1.0])
def test_tilt_while_the_whole_face_touches(share):
    """K = 1 + c f/(2 w), exactly for any number of slices."""
    f = 2 * LOAD / STIFFNESS * share
    assert factor(15, tilted(f)) == pytest.approx(1 + STIFFNESS * f / (2 * LOAD), rel=1e-9)


@pytest.mark.parametrize("ratio", [3.0, 5.0])
def test_tilt_beyond_converges_to_the_root(ratio):
    """K = √(2 c f/w): a thousandth at 201 slices, at second order or better."""
    exact = np.sqrt(2 * ratio)
    errors = [abs(factor(n, tilted(ratio * LOAD / STIFFNESS)) / exact - 1) for n in (25, 51, 201)]
    assert errors[-1] < 1e-3
    assert errors[-1] < 0.15 * errors[0]


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_crowning_while_the_whole_face_touches(share):
    """K = 1 + c C/(3 w) up to C = 3 w/(2 c); order two in the number of slices."""
    c = share * 1.5 * LOAD / STIFFNESS
    exact = 1 + STIFFNESS * c / (3 * LOAD)
    errors = [abs(factor(n, crowned(c)) / exact - 1) for n in (15, 31, 101)]
    assert errors[-1] < 1e-3
    assert np.log(errors[0] / errors[1]) / np.log(31 / 15) > 1.8


def test_crowning_beyond_touches_the_middle_only():
    """K = c C (b'/b)²/w with (2/3) c C (b'/b)³ = w."""
    c = 4.0 * LOAD / STIFFNESS
    width = (1.5 * LOAD / (STIFFNESS * c)) ** (1 / 3)
    exact = STIFFNESS * c * width**2 / LOAD
    assert factor(201, crowned(c)) == pytest.approx(exact, rel=1e-3)


BASE = load_case("wind-5mw")
ANGLES = np.linspace(0.0, 0.1, 5)


def stage(**changes):
    return rigid_stage(BASE.with_(**changes))


@pytest.fixture(scope="module")
def one_spring():
    return stage()


@pytest.fixture(scope="module")
def one_slice():
    return stage(
        **{
            "stage.gear_mesh.model": "face_load",
            "stage.gear_mesh.slices": 1,
            "stage.gear_mesh.path_only": True,
        }
    )


@pytest.fixture(scope="module")
def many_slices():
    return stage(**{"stage.gear_mesh.model": "face_load"})


def test_one_slice_at_the_centre_of_the_line_is_one_spring(one_spring, one_slice):
    a, b = static(one_spring, ANGLES), static(one_slice, ANGLES)
    for name in ("pair_load", "gear_mesh_force", "port_torque"):
        largest = abs(a[name]).max().item()
        np.testing.assert_allclose(b[name], a[name], atol=1e-8 * largest)


def test_one_slice_is_one_spring_in_time(one_spring, one_slice):
    step = {"solver.time_step": 1e-5}
    models = [rigid_stage(m.case.with_(**step)) for m in (one_spring, one_slice)]
    a, b = (simulate(m, duration=5e-3).data for m in models)
    largest = abs(a.pair_load).max().item()
    np.testing.assert_allclose(b.pair_load, a.pair_load, atol=1e-6 * largest)


def revolved(model):
    return revolution(model.modal, ANGLES, model.system.rated_torque)


def distribution(model, gear_mesh):
    """Line load summed over pairs and positions on a grid along the face."""
    equilibrium = revolved(model)
    slices, grid = (
        line_loads(equilibrium),
        np.linspace(-0.5, 0.5, 41) * BASE.view().stage.face_width,
    )
    total = np.zeros_like(grid)
    for load, z, ends in zip(slices.line_load, slices.z, slices.ends, strict=True):
        for w, at, (low, high) in zip(load[gear_mesh], z[gear_mesh], ends[gear_mesh], strict=True):
            if np.isfinite(w).all():
                inside = (grid >= low) & (grid <= high)
                total += np.where(inside, np.interp(grid, at, w), 0.0)
    return total


def test_slices_add_up_to_force_and_moment_and_the_equilibrium_closes(many_slices):
    equilibrium = revolved(many_slices)
    assert equilibrium.closure.max() < 1e-8
    slices, pairs = line_loads(equilibrium), many_slices.system.pairs
    largest = equilibrium.pair_load.max()
    np.testing.assert_allclose(
        np.nansum(slices.force, axis=-1), equilibrium.pair_load, atol=1e-8 * largest
    )
    for m in range(len(pairs.s0)):
        at = np.nonzero(equilibrium.pair_tooth[:, m] >= 0)
        s = equilibrium.pair_position[:, m][at]
        values = interpolated(pairs, m, pairs.slice_table, s)
        load, far = equilibrium.pair_load[:, m][at], equilibrium.far_load[:, m][at]
        z, k, _ = np.split(values[:, LINE_COLUMNS : LINE_COLUMNS + 45], 3, axis=1)
        centre, arm = interpolated(pairs, m, pairs.z_table, s), pairs.half_face[m]
        even = (z * k).sum(axis=1) / k.sum(axis=1)
        np.testing.assert_allclose(centre, even, atol=1e-6 * arm)  # two columns, interpolated
        moment = (slices.force[:, m][at] * (z - centre[:, None])).sum(axis=1)
        np.testing.assert_allclose(
            moment, values[:, 0] * (2 * far - load), atol=1e-8 * largest * arm
        )


def test_load_is_continued_as_far_as_it_does_not_hold():
    load = np.array([[1.0, 2.0, 4.0], [3.0, 2.0, 2.0]])
    ends = with_ends(load, np.array([0.5, 0.0]))
    assert ends[0] == pytest.approx([1.0, 1.0, 2.0, 4.0, 4.0])
    assert ends[1] == pytest.approx([3.875, 3.0, 2.0, 2.0, 2.375])
    thick = with_ends(load[:1], np.array([0.2]))  # two fifths of the half slice hold the end's load
    assert thick[0] == pytest.approx([0.7, 1.0, 2.0, 4.0, 4.6])


@pytest.mark.parametrize("section", [0.0, 0.03, 0.1, 0.25, 0.7, 1.0])
def test_factor_of_a_tilted_load_over_sections_of_the_face(section):
    """K − 1 of a load that rises along the face is less by the share of a section."""
    load = 1.0 + 0.6 * np.linspace(-1.0, 1.0, 31)
    for line_load in (load, load[::-1]):
        assert factor_along(line_load, section) == pytest.approx(1.0 + 0.6 * (1.0 - section))
    peak = np.where(np.arange(31) == 15, 4.0, 1.0)  # two steps of the face wide
    steps = max(30.0 * section, 1e-9)
    if steps >= 2.0:
        largest = factor_along(peak, section) * mean_along(peak)
        assert 1.0 + 3.0 / steps == pytest.approx(largest, rel=0.15)
        assert largest <= 1.0 + 3.0 / steps + 1e-12


def test_forces_that_are_no_numbers_are_no_equilibrium(many_slices, monkeypatch):
    """The law of slices is not said to be used, so that it gives none."""
    monkeypatch.setattr(equilibrium, "law_functions", lambda pairs: functions([]))
    with pytest.raises(FlexgearError, match="no equilibrium"):
        revolved(many_slices)


def test_twice_the_slices_tell_the_same(many_slices):
    finer = stage(**{"stage.gear_mesh.model": "face_load", "stage.gear_mesh.slices": 31})
    for gear_mesh in (0, 4, 7):
        one, two = (distribution(m, gear_mesh) for m in (many_slices, finer))
        assert one.max() / one.mean() == pytest.approx(two.max() / two.mean(), rel=0.01)


RELIEF = {
    f"stage.{gear}.modifications.tip_relief": {
        "amount": 3e-4,
        "length": 3e-2,
        "form": "parabolic",  # a short one leaves an edge
    }
    for gear in ("planet", "sun", "ring")
}


@pytest.mark.slow
def test_tips_touch_off_the_path_unless_they_are_relieved(many_slices):
    """Sharp tips share the load with pairs that have not come onto the path yet; relieved by more
    than teeth give way, they do as if they ended there."""
    path_only = {"stage.gear_mesh.model": "face_load", "stage.gear_mesh.path_only": True}
    sharp = [revolved(m).pair_load for m in (many_slices, stage(**path_only))]
    assert (sharp[0] > 0).sum() > (sharp[1] > 0).sum()
    assert sharp[0].max() < 0.95 * sharp[1].max()
    both = [{"stage.gear_mesh.model": "face_load"}, path_only]
    fine = {"stage.gear_mesh.slices": 101, **RELIEF}  # slices of the longer line are wider
    relieved = [revolved(stage(**change, **fine)).pair_load for change in both]
    np.testing.assert_allclose(*relieved, atol=2e-3 * relieved[0].max())


COUNT = 15
PLACE = np.linspace(-0.35, 1.35, COUNT)
LOCAL = 2e-9  # m/N


def parameters(flexibility, gap, scale=0.0, limit=1e9, tau=0.0):
    lower = flexibility[np.tril_indices(COUNT)]
    stiffness = 1 / np.diag(flexibility)
    ones = np.ones(COUNT)
    head = [COUNT, tau, 0.0]
    return np.concatenate([head, PLACE, stiffness, gap, scale * ones, limit * ones, lower])


def flexible(rng, reach):
    """A positive definite matrix that falls off along the face."""
    off = np.abs(PLACE[:, None] - PLACE)
    spread = LOCAL * (np.eye(COUNT) + 0.8 * np.exp(-off / reach))
    return spread * np.outer(*[1 + 0.2 * rng.random(COUNT)] * 2)


def pressed(p, a, b):
    return respond(COUPLED_SLICES_LAW, p, np.array([[a, b], [0.0, 0.0]]))


motions = st.tuples(st.floats(-3e-5, 6e-5), st.floats(-3e-5, 6e-5))


@settings(max_examples=60)
@given(motions, st.integers(0, 1000), st.floats(0.05, 1.0))
def test_forces_without_line_contact_minimise_a_quadratic_energy(motion, seed, reach):
    """min ½ fᵀ C f − xᵀ f over f ≥ 0, by non-negative least squares on the root of C."""
    rng = np.random.default_rng(seed)
    flexibility, gap = flexible(rng, reach), 2e-5 * rng.random(COUNT)
    x = (1 - PLACE) * motion[0] + PLACE * motion[1] - gap
    root = np.linalg.cholesky(flexibility).T
    unit = np.abs(x).max() + 1e-30
    f = nnls(root, np.linalg.solve(root.T, x / unit))[0] * unit
    energy, force, _ = pressed(parameters(flexibility, gap), *motion)
    largest = max(f.sum(), 1e-3)
    assert force[0] == pytest.approx([(1 - PLACE) @ f, PLACE @ f], abs=1e-8 * largest)
    assert energy == pytest.approx(0.5 * x @ f, rel=1e-6, abs=1e-12)


def test_diagonal_flexibility_is_slices_beside_each_other():
    gap = np.linspace(0, 3e-5, COUNT)
    flexibility = np.diag(LOCAL * (1 + np.arange(COUNT)))
    motion = np.array([[3e-5, 1e-5], [0.5, -0.3]])
    both = [
        respond(law, parameters(flexibility, gap, tau=1e-5), motion)
        for law in (SLICES_LAW, COUPLED_SLICES_LAW)
    ]
    for one, two in zip(*both, strict=True):
        np.testing.assert_allclose(two, one, rtol=1e-10, atol=1e-10 * np.abs(one).max())


@pytest.mark.parametrize("approach", [1e-9, 1e-6, 3e-5])
def test_line_contact_closes_by_its_law(approach):
    """With C far stiffer than the line contact, a f ln(d/f) = δ of every slice."""
    scale, limit = 2e-10, 1e8
    p = parameters(np.eye(COUNT) * 1e-16, np.zeros(COUNT), scale, limit)
    _, force, tangent = pressed(p, approach, approach)
    f = force[0].sum() / COUNT
    assert scale * f * np.log(limit / f) + 1e-16 * f == pytest.approx(approach, rel=1e-9)
    slope = COUNT / (scale * (np.log(limit / f) - 1) + 1e-16)
    assert tangent[0].sum() == pytest.approx(slope, rel=1e-6)
