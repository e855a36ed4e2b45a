"""Rows that are always there: bearings with a law, given forces, supports in turning frames."""

from __future__ import annotations

import math

from flexgear.compiled import INNER, PART, njit


@njit(**INNER)
def _turned(vector, ca, sa, coef):
    """Components of a 6-vector along axes turned about z by an angle of this cosine and sine."""
    for o in range(0, 6, 3):
        coef[o] = ca * vector[o] + sa * vector[o + 1]
        coef[o + 1] = -sa * vector[o] + ca * vector[o + 1]
        coef[o + 2] = vector[o + 2]


@njit(**PART)
def fixed_rows(fixed, places, theta, rows, counts):
    """Rows and elements of bearings, given forces and supports after ``counts``, which carry on
    something after the ``places`` of gear meshes; new counts."""
    count, element_count = counts
    turned_by, ca, sa = -1, 1.0, 0.0
    for f in range(fixed.row.shape[0]):
        fixed_part, row = fixed.row[f], rows.row[count + f]
        row.kind, row.owner, row.stiffness = fixed_part.kind, fixed_part.owner, fixed_part.stiffness
        row.sided, row.line, row.beyond, row.following = 0, -1, 0, 0
        row.along, row.damping, row.offset = 0.0, 0.0, 0.0
        width = 0
        for e in range(2):
            end = fixed.end[f, e]
            if end.block >= 0:
                rows.blocks[count + f, width] = end.block
                if end.angle >= 0 and end.angle != turned_by:
                    turned_by, angle = end.angle, theta[end.angle]
                    ca, sa = math.cos(angle), math.sin(angle)
                c, s = (ca, sa) if end.angle >= 0 else (1.0, 0.0)
                _turned(fixed.vector[f, e], c, s, rows.coef[count + f, width])
                width += 1
        row.width = width
    for e in range(fixed.element.shape[0]):
        fixed_part, element = fixed.element[e], rows.element[element_count + e]
        element.law, element.rows = fixed_part.law, fixed_part.rows
        element.first, element.place = count + fixed_part.first, places + e
        for p in range(fixed.parameters.shape[1]):
            rows.parameters[element_count + e, p] = fixed.parameters[e, p]
    return count + fixed.row.shape[0], element_count + fixed.element.shape[0]
