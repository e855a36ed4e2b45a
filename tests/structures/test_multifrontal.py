"""The multifrontal factor: on one thread and on several, dense and sparse right-hand sides."""

import threading

import numpy as np
import pytest
import scipy.sparse as sp
from plain_meshes import annulus

from flexgear.model.errors import FlexgearError
from flexgear.structures.blas import add_product, subtract_square
from flexgear.structures.fem import assemble
from flexgear.structures.fronts import PANEL, eliminated
from flexgear.structures.multifrontal import Multifrontal
from flexgear.structures.sparse_rows import csr_times
from flexgear.structures.tree_tasks import tree_tasks

RANDOM = np.random.default_rng(11)


@pytest.fixture(scope="module")
def body():
    """A regular matrix (3n, 3n) and its nodes."""
    model = assemble(annulus((24, 2, 3), teeth=8), 210e9, 0.3, 7850.0)
    return (model.stiffness + 1e6 * model.mass).tocsr(), model.nodes


@pytest.fixture(scope="module")
def factors(body):
    return {threads: Multifrontal(*body, leaf=12, threads=threads) for threads in (1, 2, 3)}


@pytest.mark.parametrize("columns", [1, 7, 16, 70])
def test_solution_is_that_of_the_matrix(body, factors, columns):
    matrix, _ = body
    right = RANDOM.standard_normal((matrix.shape[0], columns))
    x = factors[2].solve(right)
    assert np.abs(matrix @ x - right).max() < 1e-13 * np.abs(matrix).max() * np.abs(x).max()
    assert np.array_equal(factors[2].solve(np.asfortranarray(right)), x)
    half = factors[2].forward(right)
    energy = np.sum(half * half, axis=0)  # |L^{-1} g|^2 = g . A^{-1} g
    assert np.allclose(energy, np.sum(right * x, axis=0), rtol=1e-9)


@pytest.mark.parametrize("threads", [2, 3])
def test_threads_change_no_bit(body, factors, threads):
    right = RANDOM.standard_normal((body[0].shape[0], 24))
    assert factors[threads].entries == factors[1].entries
    assert np.array_equal(factors[threads].forward(right), factors[1].forward(right))
    assert np.array_equal(factors[threads].solve(right), factors[1].solve(right))


def test_sparse_right_sides_give_the_same(body, factors):
    n = body[0].shape[0]
    right = sp.random_array((n, 9), density=3e-3, random_state=RANDOM, format="csr")
    expected = factors[2].forward(right.toarray())
    found = factors[2].forward_sparse(right)
    assert np.allclose(found.toarray(), expected, rtol=1e-12, atol=1e-25)
    assert np.all(found.data != 0.0)
    assert found.nnz < 0.7 * expected.size
    assert np.allclose(
        factors[2].solve_sparse(right), factors[2].solve(right.toarray()), rtol=1e-12, atol=1e-25
    )
    assert factors[2].forward_sparse(sp.csr_matrix((n, 2))).nnz == 0


@pytest.mark.parametrize(
    ("size", "own"), [(1, 1), (40, 40), (300, 3), (400, 300), (2 * PANEL, PANEL)]
)
def test_a_front_leaves_the_schur_complement(size, own):
    half = RANDOM.standard_normal((size, size))
    whole = half @ half.T + size * np.eye(size)
    panels, rest = eliminated(np.tril(whole), own)
    assert [p.begin for p in panels][1:] == [p.end for p in panels][:-1]
    if own < size:
        expected = whole[own:, own:] - whole[own:, :own] @ np.linalg.solve(
            whole[:own, :own], whole[:own, own:]
        )
        assert np.allclose(np.tril(rest), np.tril(expected), rtol=1e-10, atol=1e-10 * size)
    else:
        assert rest is None
    x = RANDOM.standard_normal((size, 3))
    y = x.copy()
    for panel in panels:
        panel.forward(y)
    lower = np.linalg.cholesky(whole)[:own, :own]
    assert np.allclose(y[:own], np.linalg.solve(lower, x[:own]), rtol=1e-9, atol=1e-12)


def test_a_singular_matrix_is_refused(body):
    matrix, nodes = body
    n = matrix.shape[0]
    for threads in (1, 2):
        with pytest.raises(FlexgearError, match="singular"):
            Multifrontal(
                sp.csr_matrix(matrix - 1e3 * sp.eye_array(n) * matrix.max()), nodes, 12, threads
            )


@pytest.mark.parametrize("threads", [1, 2, 4])
def test_tasks_visit_every_front_once_and_in_order(threads):
    parents = np.array([2, 2, 6, 5, 5, 6, 12, 9, 9, 11, 11, 12, -1, 14, -1])  # two trees
    tasks = tree_tasks(parents, RANDOM.random(len(parents)) + 0.1, threads)
    lock = threading.Lock()
    for way in (tasks.climb, tasks.descend):
        seen = []

        def run(fronts, seen=seen):
            with lock:
                seen.extend(fronts)

        way(run, threads)
        assert sorted(seen) == list(range(len(parents)))
        place = np.argsort(seen)
        upward = [place[k] < place[p] for k, p in enumerate(parents) if p >= 0]
        assert all(upward) if way == tasks.climb else not any(upward)


def test_an_error_in_a_task_comes_through():
    tasks = tree_tasks(np.array([2, 2, -1]), np.ones(3), 2)

    def fail(fronts):
        raise ValueError("front")

    with pytest.raises(ValueError, match="front"):
        tasks.climb(fail, 2)


def test_products_in_place():
    big = RANDOM.standard_normal((20, 30))
    a, b = big[3:10, 4:9], big[10:15, 2:14]
    c = np.ones((9, 20))
    expected = 0.5 * c[1:8, 3:15] - 2.0 * a @ b
    add_product(-2.0, a, b, 0.5, c[1:8, 3:15])
    assert np.allclose(c[1:8, 3:15], expected)
    assert np.all(c[0] == 1.0) and np.all(c[:, 15:] == 1.0)
    d = np.zeros((5, 7))
    add_product(1.0, b[:, :7].T[:5], a.T, 0.0, d)
    assert np.allclose(d, b[:, :5].T @ a.T)
    square = np.zeros((9, 9))
    subtract_square(a, square[1:8, 1:8])
    assert np.allclose(square[1:8, 1:8], np.tril(-a @ a.T))
    empty = np.ones((3, 2))
    add_product(1.0, np.empty((3, 0)), np.empty((0, 2)), 1.0, empty)
    add_product(1.0, np.empty((0, 3)), np.empty((3, 2)), 1.0, np.empty((0, 2)))
    assert np.all(empty == 1.0)


@pytest.mark.parametrize("columns", [1, 5, 48])
def test_sparse_products(columns):
    matrix = sp.random_array((700, 300), density=0.03, random_state=RANDOM, format="csr")
    x = RANDOM.standard_normal((300, columns))
    assert np.allclose(csr_times(matrix, x), matrix @ x)
    assert np.allclose(csr_times(matrix, np.asfortranarray(x)), matrix @ x)
