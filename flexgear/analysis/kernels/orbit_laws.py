"""Laws of all force elements over the samples of one period."""

from __future__ import annotations

from flexgear.compiled import UNCOUNTED, njit


@njit(**UNCOUNTED)
def evaluate_laws(laws, elements, parameters, motion, force, tangent, space):
    """Forces and tangents at the motion of all rows.

    elements (E, 4): law, sample, first row there, rows; parameters (E, p); motion (N, n, 2): δ, δ̇
    of the rows of N samples; force (N, n) and tangent (2, N, n, n) are overwritten; space: work
    arrays (2, r), (2, r), (2, r, r) for elements of each number of rows r, from 1.
    """
    force[:], tangent[:] = 0.0, 0.0
    for e in range(elements.shape[0]):
        law, j, first, count = elements[e]
        at_element, answer, slopes = space[count - 1]
        for a in range(count):
            at_element[0, a], at_element[1, a] = motion[j, first + a, 0], motion[j, first + a, 1]
        laws[law](parameters[e], at_element, answer, slopes)
        for a in range(count):
            force[j, first + a] = answer[0, a]
            for b in range(count):
                tangent[0, j, first + a, first + b] = slopes[0, a, b]
                tangent[1, j, first + a, first + b] = slopes[1, a, b]
