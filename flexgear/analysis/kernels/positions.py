"""Equilibria at many positions, each until coast flanks and laws agree with its answer."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.kernels.coast_flanks import look_at_rest
from flexgear.analysis.kernels.contact_newton import AGREES, TOUCHING, disagree
from flexgear.analysis.kernels.pair_loads import note_loads
from flexgear.analysis.kernels.static_position import CLOSURE, solve_position
from flexgear.analysis.kernels.vectors import fill, put
from flexgear.arrays import Array
from flexgear.compiled import FAST, INNER, PART, UNCOUNTED, ZERO, njit
from flexgear.coupling.kernels.neighbours import freeze_neighbours

LOOKS = 60  # tries to agree on coast flanks and on linearised laws
DEEP = 0.01  # base pitches: a start at which all slices of a flank touch
CAUTIOUS = 20  # of them after which laws go half way only


class Positions(NamedTuple):
    """Positions: what is given and what is found, as ``Equilibrium`` has it."""

    theta: Array
    port_torques: Array
    torques: Array
    eta: Array
    active_flanks: NDArray[np.int64]
    closure: Array


@njit(**INNER, fastmath=FAST)
def modal_part(elastic, forces, omega2, first, eta):
    """eta[first:] = Φᵀ f / ω² from the channels' elastic modes (n_c, n)."""
    part = eta[first:]
    fill(part, 0.0)
    for c in range(forces.shape[0]):
        f = forces[c]
        if f != 0.0:
            for j in range(part.shape[0]):
                part[j] += f * elastic[c, j]
    for j in range(part.shape[0]):
        part[j] /= omega2[j]


@njit(**INNER)
def _coast_flanks_agree(gears, rows, pairs, theta, motion, active_flanks):
    """Whether no coast flank has come near that is not looked at; looks at those from now on."""
    agreed, meshes = True, gears.mesh
    for m in range(meshes.shape[0]):
        b = meshes[m].opposite
        if b >= 0 and active_flanks[b] == 0:
            look_at_rest(gears, rows, pairs, theta, motion, m, active_flanks)
            agreed = agreed and active_flanks[b] == 0
    return agreed


@njit(**INNER)
def _start_slices(meshes, forward, memory):
    """Slices of flanks that do not carry start open; of those that do, where they were last, or
    with all of them touching where they were open."""
    for m in range(meshes.shape[0]):
        if meshes[m].slices == 0:
            continue
        carries = (meshes[m].carries == 1) == forward
        first = meshes[m].places * m
        for place in range(first, first + meshes[m].places):
            for a in range(2):
                if not carries:
                    memory[place, 0, a] = -TOUCHING
                elif memory[place, 0, a] < 0.0:
                    memory[place, 0, a] = DEEP * meshes[m].pitch


@njit(**PART)
def _solve_one(laws, theta, port_torques, forward, train, work, out, active_flanks):
    """One position until coast flanks and laws agree; (rows, tooth pairs, closure)."""
    gears, rows, motion = work.elements.gears, work.rows, work.channels[0]
    meshes = gears.mesh
    memory = work.memory
    for m in range(meshes.shape[0]):
        active_flanks[m] = meshes[m].carries if forward else 1
    _start_slices(meshes, forward, memory)
    n, pairs, closure = ZERO, ZERO, 0.0
    for look in range(LOOKS):
        n, count, pairs, closure = solve_position(
            laws, theta, port_torques, forward, active_flanks, train, work, out
        )
        if not closure <= CLOSURE:
            break
        share = 0.5 if look > CAUTIOUS else 1.0
        if disagree(laws, work, count, out, AGREES, share):
            continue  # coast flanks are near or far only where all laws hold
        if _coast_flanks_agree(gears, rows, pairs, theta, motion, active_flanks):
            break
    return n, pairs, closure


@njit(**UNCOUNTED, nogil=True)
def solve_positions(laws, span, forward, train, modes, work, out, solutions, loads):
    """Solve the positions of a span; results go to ``solutions`` and ``loads``. Returns the number
    of the position that failed, or the end of the span, and that position's closure."""
    elastic, omega2 = modes
    rows, delta, channel_forces = work.rows, work.delta[0], work.channels[1]
    angles, port_torques, torques = solutions.theta, solutions.port_torques, solutions.torques
    reactions = train.reactions
    r = train.moved.shape[1] - reactions.shape[0]
    for p in range(span[0], span[1]):
        n, pairs, closure = _solve_one(
            laws, angles[p], port_torques[p], forward[p], train, work, out,
            solutions.active_flanks[p],
        )  # fmt: skip
        if not closure <= CLOSURE:
            return p, closure
        solutions.closure[p] = closure
        for f in range(reactions.shape[0]):
            torques[p, reactions[f]] = -out[n + r + f]
        put(solutions.eta[p], out[n : n + r])
        modal_part(elastic, channel_forces, omega2, r, solutions.eta[p])
        freeze_neighbours(rows, n, out)
        note_loads(rows, n, pairs, out, delta, p, loads)
    return span[1], 0.0
