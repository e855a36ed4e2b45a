"""Solutions of a body of equal sectors with the motion of its interface given.

    K x = g + B^T rho,   B x = q,

with ties that every sector has (B_t, motion q_t, reactions lambda) and others that see all sectors
together (C, q_o, reactions -mu). A sector's interior i is eliminated with the rows of its borders
b and of its own ties,

    f = L^{-1} g_i,   V = L^{-1} K_ib,   Z_t = L^{-1} B_ti^T,   Z_o = L^{-1} C_i^T.

With D = Z_t^T Z_t and B^ = B_tb - Z_t^T V its own ties follow,

    lambda = d - D^{-1} B^ x_b,   d = D^{-1} (q_t - Z_t^T f),

and borders meet in (S + B^^T D^{-1} B^) x_b = g_b - V^T f + B^^T d, summed over sectors and solved
by harmonics; it is definite, for the ties of every sector hold the body. The others, while free,
move by q0, and with Y = solution under C^T, G = C Y they take mu = G^{-1} (q0 - q_o),

    x_b <- x_b - Y_b mu,   lambda <- lambda + E^T mu + D^{-1} B^ Y_b mu,   E = Z_o^T Z_t D^{-1},
    x_i = L^{-T} (f - V x_b + Z_t lambda - Z_o mu).

No matrix of the size of the body times the interface is ever held.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from flexgear.arrays import Array, Ints
from flexgear.structures.cyclic.sectors import Harmonics, with_rigid, without_rigid
from flexgear.structures.cyclic.ties import SectorTies
from flexgear.structures.linalg.dense import (
    CHUNK,
    THREADS,
    balanced_inverse,
    scaled_inverse,
    shared,
    times,
)
from flexgear.structures.linalg.sparse import Elimination


@dataclass(eq=False)
class Pass:
    """Intermediate results of a solution under k load vectors.

    pieces: for groups of neighbouring sectors, which these are and an array (i + 2b + t,
    sectors k) whose first i rows hold f; empty where there are no loads. d (t, z, k): D^{-1} (q_t -
    Z_t^T f). border (b, z, k): x_b. q0 (m, k): motion of the other ties while they are free. mu
    (m, k): forces in the other ties, with the sign reversed.
    """

    pieces: list[tuple[slice, Array]]
    d: Array
    border: Array
    q0: Array
    mu: Array


@dataclass(frozen=True, eq=False)
class LocalTies:
    """Rows of the other ties that touch this sector.

    at (r,): which of the m rows of all other ties they are; z (i, r): their columns of Z_o;
    e (t, r): their columns of E^T.
    """

    at: Ints
    z: Array
    e: Array


class CyclicSolver:
    """Factors of a body of equal sectors and its ties.

    stiffness: (t, t, z) reactions of periodic ties under unit motion of sector 0's, others free;
    coupling: H (m, t, z) motion of the others then; flexibility: G (m, m), inverse: G^{-1}.
    """

    def __init__(
        self, interior: Elimination, ties: SectorTies, rigid: Array, definite: bool = True
    ) -> None:
        """interior: factor of [K B^T; B 0].

        rigid: R (3n + 3b, 6) of `cyclic/sectors.py`, or no columns where inertia stands in K too;
        definite: whether the held body is, its interior always.
        """
        self._interior, self._ties = interior, ties
        self.count = ties.sectors.count
        self._n = 3 * len(ties.sectors.nodes)
        i, b = interior.size, 3 * ties.sectors.border
        t = ties.rows.shape[0]
        self._b, self._t = b, t
        ends = np.cumsum([0, i, 2 * b, t])
        self._rows = [slice(a, e) for a, e in pairwise(ends)]
        rest = interior.rest
        border, tie = slice(0, 2 * b), slice(2 * b, 2 * b + t)
        self._rigid = rigid
        ends_rigid = rigid[i:]
        self._hat = with_rigid(rest[tie, border], ends_rigid, ties.rows @ rigid)  # B^
        self._d_inverse = scaled_inverse(-rest[tie, tie])
        self.gain = self._d_inverse @ self._hat
        free = without_rigid(rest[border, border], ends_rigid)
        condensed = free + self._hat.T @ self.gain
        self.border_harmonics = Harmonics(condensed, self.count, definite)
        self._tie_others(scaled_inverse if definite else balanced_inverse)
        self.stiffness = self._multipliers(self._unit_run()).transpose(0, 2, 1)

    @property
    def ends(self) -> int:
        """Ways in which a sector's ends move, see `shapes`."""
        return 2 * self._b + self._t

    def solve(self, load: Array | None, q: Array | None = None) -> Array:
        """Fields x (3n, z, k) under loads g or none; q (6 nodes, k) or zero."""
        return self._field(self._run(load, q))

    def reactions(self, load: Array | None, q: Array | None = None) -> Array:
        """Reactions rho (6 nodes, k) of the interface likewise."""
        run = self._run(load, q)
        return self._ties.joined(self._multipliers(run), -run.mu)

    def inside(self, load: Array) -> Array:
        """x_i (i, k) of one sector under loads g_i, its borders held."""
        inside = self._rows[0]
        x = np.zeros((self._rows[-1].stop, load.shape[1]))
        x[inside] = load
        self._interior.forward(x)
        x[inside.stop :] = 0.0
        self._interior.backward(x)
        return x[inside]

    def other_share(self) -> Array:
        """N (m, t z + m) of Psi = Psi_t [I 0] + Y N, on [periodic in sector axes, others]."""
        return self.inverse @ self.other_motions()

    def other_motions(self) -> Array:
        """[-H I] (m, t z + m)."""
        m, t, z = self.coupling.shape
        return np.hstack([-self.coupling.reshape(m, t * z), np.eye(m)])

    def periodic_ends(self) -> Array:
        """Ends (2b + t, z, t) of the motion under sector 0's ties; see `shapes`."""
        return self._ends(self._unit_run())

    def other_ends(self) -> Array:
        """Ends (2b + t, z, m) of Y, the motion under unit loads on other ties."""
        m, z = self._ties.other_size, self.count
        d, border = np.zeros((self._t, z, m)), np.zeros((self._b, z, m))
        run = Pass([], d, border, np.zeros((m, m)), -np.eye(m))
        self._release(run)
        return self._ends(run)

    def shapes(self) -> tuple[Array, dict[int, tuple[Ints, Array]]]:
        """Shapes in which a sector without loads moves: x(s) = R e(s) - U(s) mu[at(s)].

        Returns R (i + 2b, 2b + t), the same for all sectors, and for each sector with other ties
        the pair at (r,) and U (i + 2b, r). The rows of both are a sector's own dofs and those of
        the next border. e(s) (2b + t) are the sector's ends: the motion of its border and of the
        next, and -lambda of its own ties.
        """
        inside, size = self._rows[0], self._rows[-1].stop
        stop, ends = self._rows[1].stop, size - inside.stop
        out = np.zeros((stop, ends))

        def part(columns: slice) -> None:
            x = np.zeros((size, columns.stop - columns.start))
            at = np.arange(columns.start, columns.stop)
            x[inside.stop + at, at - columns.start] = 1.0
            self._interior.backward(x)
            out[:, columns] = x[:stop]

        shared(ends, part)
        local = {}
        for s, tied in self._local.items():
            x = np.zeros((size, len(tied.at)))
            x[inside] = tied.z
            self._interior.backward(x)
            local[s] = tied.at, x[:stop]
        return out, local

    # -- building

    def _unit_run(self) -> Pass:
        """Unit motion of sector 0's ties, the others free."""
        q = np.zeros((self._t, self.count, self._t))
        q[:, 0] = np.eye(self._t)
        return self._begin(None, q, self._t)

    def _tie_others(self, inverse: Callable[[Array], Array]) -> None:
        """Z_o, E, Y_b, G and H of the ties that do not share the period."""
        ties, b, z = self._ties, self._b, self.count
        m = ties.other_size
        inside, border, tie = self._rows
        pulled = self._pulled(ties.rows.T.toarray())[inside]
        hat = np.zeros((b, z, m))
        along = np.zeros((z, m, self._t))  # F = Z_o^T Z_t of every sector
        flexibility = np.zeros((m, m))
        self._local: dict[int, LocalTies] = {}
        every = self._pulled(sp.vstack([rows for _, rows in ties.local]).T.toarray())
        begin = np.cumsum([len(at) for at, _ in ties.local])[:-1]
        for s, ((at, _), local) in enumerate(
            zip(ties.local, np.split(every, begin, axis=1), strict=True)
        ):
            if not len(at):
                continue
            f = -local[tie].T
            e = f @ self._d_inverse
            free = local[inside] - pulled @ e.T
            flexibility[np.ix_(at, at)] += free.T @ free
            ends = local[border] - self._hat.T @ e.T
            hat[:, s, at] += ends[:b]
            hat[:, (s + 1) % z, at] += ends[b:]
            along[s, at] = f
            self._local[s] = LocalTies(at, np.ascontiguousarray(local[inside]), e.T)
        self._other_hat = sp.csr_matrix(hat.reshape(b * z, m))  # a bolt's on a sector or two
        self._other_border = self.border_harmonics.solve(hat).reshape(b * z, m)  # Y_b
        del hat
        flexibility += self._other_hat.T @ self._other_border
        self.flexibility = 0.5 * (flexibility + flexibility.T)
        self.inverse = inverse(self.flexibility)
        ahead = self._ahead(self._other_border.reshape(b, z, m))
        self.coupling = np.moveaxis(ahead, 2, 0) + (along @ self._d_inverse).transpose(1, 2, 0)

    def _pulled(self, columns: Array) -> Array:
        """Columns of ties (3n or 3n + 3b, k) after elimination: (i + 2b + t, k).

        The first i rows are L^{-1} of theirs, the rest is left for borders and ties.
        """
        x = np.zeros((self._rows[-1].stop, columns.shape[1]))
        x[: len(columns)] = columns
        if columns.shape[1]:
            self._interior.forward(x)
            inside, ends = self._rows[:2]
            motion = columns.T @ self._rigid[: len(columns)]
            x[ends] = with_rigid(x[ends].T, self._rigid[inside.stop :], motion).T
        return x

    # -- one solution

    def _run(self, load: Array | None, q: Array | None) -> Pass:
        """All ties at their motion."""
        local = None if q is None else self._ties.split(q)[0]
        columns = load.shape[2] if load is not None else q.shape[1]  # type: ignore[union-attr]
        run = self._begin(load, local, columns)
        run.mu = self.inverse @ (run.q0 - (0.0 if q is None else q[self._ties.other_dofs]))
        self._release(run)
        return run

    def _begin(self, load: Array | None, q: Array | None, k: int) -> Pass:
        """Periodic ties at their motion (t, z, k) in the sectors' axes, the others free."""
        b, z, t = self._b, self.count, self._t
        rest = np.zeros((2 * b + t, z, k))
        pieces, pulled = ([], {}) if load is None else self._eliminate(load, rest)
        drive = rest[2 * b :]
        if q is not None:
            drive = drive + q  # D d
        d = (self._d_inverse @ drive.reshape(t, z * k)).reshape(t, z, k)
        pull = rest[: 2 * b]
        pull += (self._hat.T @ d.reshape(t, z * k)).reshape(2 * b, z, k)
        pull[:b, 1:] += pull[b:, :-1]
        pull[:b, 0] += pull[b:, -1]
        border = self.border_harmonics.solve(pull[:b])
        q0 = self._other_hat.T @ border.reshape(b * z, k)
        for s, tied in self._local.items():
            q0[tied.at] += tied.e.T @ drive[:, s]
            if s in pulled:
                q0[tied.at] += pulled[s]
        return Pass(pieces, d, border, q0, np.zeros_like(q0))

    def _release(self, run: Pass) -> None:
        """Forces -mu of the other ties upon x_b and d."""
        run.border -= times(self._other_border, run.mu).reshape(run.border.shape)
        for s, tied in self._local.items():
            run.d[:, s] += tied.e @ run.mu[tied.at]

    def _multipliers(self, run: Pass) -> Array:
        """lambda (t, z, k)."""
        return run.d - self._ahead(run.border)

    def _ahead(self, border: Array) -> Array:
        """D^{-1} B^ x_b (t, z, k)."""
        b, shape = self._b, (self._t, *border.shape[1:])
        flat = border.reshape(b, border[0].size)
        near = (self.gain[:, :b] @ flat).reshape(shape)
        far = (self.gain[:, b:] @ flat).reshape(shape)
        return near + np.roll(far, -1, axis=1)

    def _eliminate(
        self, load: Array, rest: Array
    ) -> tuple[list[tuple[slice, Array]], dict[int, Array]]:
        """Eliminate the interiors of all sectors under loads (3n, z, k).

        Returns the pieces of `Pass`, and for each sector with other ties Z_o^T f (r, k). rest
        (2b + t, z, k) takes what is left for both borders and the ties.
        """
        k, size = load.shape[2], self._rows[-1].stop
        flat = load.reshape(self._n, self.count * k)
        beyond = rest.reshape(len(rest), self.count * k)
        inside = self._rows[0]
        pieces: dict[int, tuple[slice, Array]] = {}
        pulled: dict[int, Array] = {}

        def part(sectors: slice) -> None:
            columns = slice(sectors.start * k, sectors.stop * k)
            x = np.empty((size, columns.stop - columns.start))
            x[: self._n] = flat[:, columns]
            x[self._n :] = 0.0
            if x[0].all():
                self._interior.forward(x)
            else:
                used = x[: self._n].any(axis=0)  # loads on a few teeth leave most sectors out
                some = np.ascontiguousarray(x[:, used])
                self._interior.forward(some)
                x[:, used] = some
            for s in range(sectors.start, sectors.stop):
                if s in self._local:
                    mine = x[inside, (s - sectors.start) * k : (s + 1 - sectors.start) * k]
                    pulled[s] = self._local[s].z.T @ mine
            beyond[:, columns] = x[inside.stop :]
            pieces[sectors.start] = sectors, x

        shared(self.count, part, self._chunk(k))
        return list(pieces.values()), pulled

    def _ends(self, run: Pass) -> Array:
        """[x_b(s); x_b(s + 1); -lambda] (2b + t, z, k)."""
        b = self._b
        out = np.empty((self.ends, self.count, run.mu.shape[1]))
        out[:b] = run.border
        out[b : 2 * b, :-1] = run.border[:, 1:]
        out[b : 2 * b, -1] = run.border[:, 0]
        np.negative(self._multipliers(run), out=out[2 * b :])
        return out

    def _field(self, run: Pass) -> Array:
        """x (3n, z, k) from f, x_b, lambda and mu; uses the pieces up."""
        inside, tie, k = self._rows[0], self._rows[-1], run.mu.shape[1]
        beyond = self._ends(run).reshape(-1, self.count * k)
        out = np.empty((self._n, self.count * k))

        def part(sectors: slice, x: Array | None = None) -> None:
            columns = slice(sectors.start * k, sectors.stop * k)
            if x is None:
                x = np.empty((tie.stop, columns.stop - columns.start))
                x[inside] = 0.0
            x[inside.stop :] = beyond[:, columns]
            for s in range(sectors.start, sectors.stop):
                if s in self._local:
                    mine = slice((s - sectors.start) * k, (s + 1 - sectors.start) * k)
                    x[inside, mine] -= self._local[s].z @ run.mu[self._local[s].at]
            self._interior.backward(x)
            out[:, columns] = x[: self._n]

        if run.pieces:
            pieces, run.pieces = run.pieces, []

            def each(which: slice) -> None:
                for piece in pieces[which]:
                    part(*piece)

            shared(len(pieces), each, chunk=1)
        else:
            shared(self.count, part, self._chunk(k))
        return out.reshape(self._n, self.count, k)

    def _chunk(self, k: int) -> int:
        """Sectors under k load vectors each that a thread takes at a time."""
        return max(1, min(CHUNK // k, self.count // THREADS))
