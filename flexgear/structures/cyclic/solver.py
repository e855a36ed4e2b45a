"""Solutions of a body of equal sectors with prescribed motion of its interface.

    K x = g + B^T rho,   B x = q,

with periodic ties (B_t, motion q_t, reactions lambda) and other ties (C, q_o, reactions -mu), see
`cyclic/ties.py`. A sector's interior i is eliminated with the rows of its borders b and of its
periodic ties,

    f = L^{-1} g_i,   V = L^{-1} K_ib,   Z_t = L^{-1} B_ti^T,   Z_o = L^{-1} C_i^T.

With D = Z_t^T Z_t and B^ = B_tb - Z_t^T V the reactions of these are

    lambda = d - D^{-1} B^ x_b,   d = D^{-1} (q_t - Z_t^T f),

and the equations of the borders (S + B^^T D^{-1} B^) x_b = g_b - V^T f + B^^T d, summed over the
sectors and solved by harmonics; the matrix is definite, for the periodic ties hold every sector.
The other ties, while free, move by q0, and with Y = solution under C^T, G = C Y their reactions are
mu = G^{-1} (q0 - q_o),

    x_b <- x_b - Y_b mu,   lambda <- lambda + E^T mu + D^{-1} B^ Y_b mu,   E = Z_o^T Z_t D^{-1},
    x_i = L^{-T} (f - V x_b + Z_t lambda - Z_o mu).

No matrix of the size of the body times the interface is ever stored.
"""

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

    pieces: for groups of neighbouring sectors, their slice and an array (i + 2b + t, sectors k)
    with f in its first i rows; empty where there are no loads. d (t, z, k): D^{-1} (q_t - Z_t^T f).
    border (b, z, k): x_b. q0 (m, k): motion of the other ties while they are free. mu (m, k): minus
    the forces in the other ties.
    """

    pieces: list[tuple[slice, Array]]
    d: Array
    border: Array
    q0: Array
    mu: Array


@dataclass(frozen=True, eq=False)
class LocalTies:
    """Rows of the other ties with entries in one sector.

    at (r,): their numbers among the m rows of all other ties; z (i, r): their columns of Z_o;
    e (t, r): their columns of E^T.
    """

    at: Ints
    z: Array
    e: Array


class CyclicSolver:
    """Factors of a body of equal sectors and its ties.

    stiffness: reactions (t, t, z) of periodic ties under unit motions of sector 0's, others free;
    coupling: motion H (m, t, z) of the others then; flexibility: G (m, m); inverse: G^{-1}.
    """

    def __init__(
        self, interior: Elimination, ties: SectorTies, rigid: Array, definite: bool = True
    ) -> None:
        """interior: factor of the interior of [K B^T; B 0] of one sector; rigid: R (3n + 3b, 6) of
        `cyclic/sectors.py`, without columns where K includes inertia; definite: whether K is with
        the interface held, as it always is on the interior."""
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
        """Number of end coordinates of a sector, see `shapes`."""
        return 2 * self._b + self._t

    def solve(self, load: Array | None, q: Array | None = None) -> Array:
        """Fields x (3n, z, k) under loads g (3n, z, k) and interface motion q (6 nodes, k); None:
        zero."""
        return self._field(self._run(load, q))

    def reactions(self, load: Array) -> Array:
        """Reactions rho (6 nodes, k) of the held interface; load: as of ``solve``."""
        run = self._run(load, None)
        return self._ties.joined(self._multipliers(run), -run.mu)

    def inside(self, load: Array) -> Array:
        """Motion x_i (i, k) of a sector's interior under loads g_i (i, k), its borders held and
        periodic ties free."""
        inside = self._rows[0]
        x = np.zeros((self._rows[-1].stop, load.shape[1]))
        x[inside] = load
        self._interior.forward(x)
        x[inside.stop :] = 0.0
        self._interior.backward(x)
        return x[inside]

    def other_share(self) -> Array:
        """N (m, t z + m) of Psi = Psi_t [I 0] + Y N, on [periodic in sector axes, other] dofs."""
        return self.inverse @ self.other_motions()

    def other_motions(self) -> Array:
        """[-H I] (m, t z + m), on [periodic in sector axes, other] dofs."""
        m, t, z = self.coupling.shape
        return np.hstack([-self.coupling.reshape(m, t * z), np.eye(m)])

    def periodic_ends(self) -> Array:
        """Ends (2b + t, z, t) under unit motions of sector 0's periodic ties; see `shapes`."""
        return self._ends(self._unit_run())

    def other_ends(self) -> Array:
        """Ends (2b + t, z, m) of Y, the motion under unit loads on other ties."""
        m, z = self._ties.other_size, self.count
        d, border = np.zeros((self._t, z, m)), np.zeros((self._b, z, m))
        run = Pass([], d, border, np.zeros((m, m)), -np.eye(m))
        self._release(run)
        return self._ends(run)

    def shapes(self) -> tuple[Array, dict[int, tuple[Ints, Array]]]:
        """Shapes of a sector without loads, x(s) = R e(s) - U(s) mu[at(s)].

        e(s) (2b + t) are the sector's ends: the motions of its border and of the next one, and
        -lambda of its periodic ties. Returns R (i + 2b, 2b + t), the same for all sectors, and for
        each sector with other ties the pair at (r,) and U (i + 2b, r). Rows: dofs of the sector and
        of the next border.
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

    def _unit_run(self) -> Pass:
        """Solution for unit motions of sector 0's periodic ties, the other ties free."""
        q = np.zeros((self._t, self.count, self._t))
        q[:, 0] = np.eye(self._t)
        return self._begin(None, q, self._t)

    def _tie_others(self, inverse: Callable[[Array], Array]) -> None:
        """Compute Z_o, E, Y_b, G and H of the other ties; inverse: function that inverts G."""
        ties, b, z = self._ties, self._b, self.count
        m = ties.other_size
        inside, border, tie = self._rows
        periodic = self._eliminated(ties.rows.T.toarray())[inside]  # Z_t
        hat = np.zeros((b, z, m))
        along = np.zeros((z, m, self._t))  # Z_o^T Z_t of every sector
        flexibility = np.zeros((m, m))
        self._local: dict[int, LocalTies] = {}
        every = self._eliminated(sp.vstack([rows for _, rows in ties.local]).T.toarray())
        begin = np.cumsum([len(at) for at, _ in ties.local])[:-1]
        for s, ((at, _), local) in enumerate(
            zip(ties.local, np.split(every, begin, axis=1), strict=True)
        ):
            if not len(at):
                continue
            f = -local[tie].T
            e = f @ self._d_inverse
            free = local[inside] - periodic @ e.T
            flexibility[np.ix_(at, at)] += free.T @ free
            ends = local[border] - self._hat.T @ e.T
            hat[:, s, at] += ends[:b]
            hat[:, (s + 1) % z, at] += ends[b:]
            along[s, at] = f
            self._local[s] = LocalTies(at, np.ascontiguousarray(local[inside]), e.T)
        self._other_hat = sp.csr_matrix(hat.reshape(b * z, m))  # a bolt is in one or two sectors
        self._other_border = self.border_harmonics.solve(hat).reshape(b * z, m)  # Y_b
        del hat
        flexibility += self._other_hat.T @ self._other_border
        self.flexibility = 0.5 * (flexibility + flexibility.T)
        self.inverse = inverse(self.flexibility)
        ahead = self._ahead(self._other_border.reshape(b, z, m))
        self.coupling = np.moveaxis(ahead, 2, 0) + (along @ self._d_inverse).transpose(1, 2, 0)

    def _eliminated(self, columns: Array) -> Array:
        """Columns of ties (3n or 3n + 3b, k) after elimination of the interior (i + 2b + t, k):
        L^{-1} times the first i rows, then the remainder on borders and periodic ties."""
        x = np.zeros((self._rows[-1].stop, columns.shape[1]))
        x[: len(columns)] = columns
        if columns.shape[1]:
            self._interior.forward(x)
            inside, ends = self._rows[:2]
            motion = columns.T @ self._rigid[: len(columns)]
            x[ends] = with_rigid(x[ends].T, self._rigid[inside.stop :], motion).T
        return x

    def _run(self, load: Array | None, q: Array | None) -> Pass:
        """Solution with prescribed motion of all ties."""
        local = None if q is None else self._ties.split(q)[0]
        columns = load.shape[2] if load is not None else q.shape[1]  # type: ignore[union-attr]
        run = self._begin(load, local, columns)
        run.mu = self.inverse @ (run.q0 - (0.0 if q is None else q[self._ties.other_dofs]))
        self._release(run)
        return run

    def _begin(self, load: Array | None, q: Array | None, k: int) -> Pass:
        """Solution for the motion q (t, z, k) of the periodic ties along the sectors' axes, None:
        zero, under k loads; the other ties free."""
        b, z, t = self._b, self.count, self._t
        rest = np.zeros((2 * b + t, z, k))
        pieces, by_load = ([], {}) if load is None else self._eliminate(load, rest)
        tie_motion = rest[2 * b :]  # D d
        if q is not None:
            tie_motion = tie_motion + q
        d = (self._d_inverse @ tie_motion.reshape(t, z * k)).reshape(t, z, k)
        force = rest[: 2 * b]
        force += (self._hat.T @ d.reshape(t, z * k)).reshape(2 * b, z, k)
        force[:b, 1:] += force[b:, :-1]
        force[:b, 0] += force[b:, -1]
        border = self.border_harmonics.solve(force[:b])
        q0 = self._other_hat.T @ border.reshape(b * z, k)
        for s, tied in self._local.items():
            q0[tied.at] += tied.e.T @ tie_motion[:, s]
            if s in by_load:
                q0[tied.at] += by_load[s]
        return Pass(pieces, d, border, q0, np.zeros_like(q0))

    def _release(self, run: Pass) -> None:
        """Add the effect of the other ties' forces -mu to x_b and d."""
        run.border -= times(self._other_border, run.mu).reshape(run.border.shape)
        for s, tied in self._local.items():
            run.d[:, s] += tied.e @ run.mu[tied.at]

    def _multipliers(self, run: Pass) -> Array:
        """Reactions lambda (t, z, k) of the periodic ties."""
        return run.d - self._ahead(run.border)

    def _ahead(self, border: Array) -> Array:
        """D^{-1} B^ x_b (t, z, k), by which motion x_b (b, z, k) of the borders lowers the
        reactions of the periodic ties: of every sector by its own border and the next one's."""
        b, shape = self._b, (self._t, *border.shape[1:])
        flat = border.reshape(b, border[0].size)
        near = (self.gain[:, :b] @ flat).reshape(shape)
        far = (self.gain[:, b:] @ flat).reshape(shape)
        return near + np.roll(far, -1, axis=1)

    def _eliminate(
        self, load: Array, rest: Array
    ) -> tuple[list[tuple[slice, Array]], dict[int, Array]]:
        """Eliminate the interiors of all sectors under loads (3n, z, k).

        Returns the pieces of `Pass`, and for each sector with other ties Z_o^T f (r, k); writes the
        remainder on both borders and the periodic ties to rest (2b + t, z, k).
        """
        k, size = load.shape[2], self._rows[-1].stop
        flat = load.reshape(self._n, self.count * k)
        beyond = rest.reshape(len(rest), self.count * k)
        inside = self._rows[0]
        pieces: dict[int, tuple[slice, Array]] = {}
        by_load: dict[int, Array] = {}

        def part(sectors: slice) -> None:
            columns = slice(sectors.start * k, sectors.stop * k)
            x = np.empty((size, columns.stop - columns.start))
            x[: self._n] = flat[:, columns]
            x[self._n :] = 0.0
            if x[0].all():
                self._interior.forward(x)
            else:
                used = x[: self._n].any(axis=0)  # loads on a few teeth leave most sectors zero
                some = np.ascontiguousarray(x[:, used])
                self._interior.forward(some)
                x[:, used] = some
            for s in range(sectors.start, sectors.stop):
                if s in self._local:
                    columns_of_s = slice((s - sectors.start) * k, (s + 1 - sectors.start) * k)
                    by_load[s] = self._local[s].z.T @ x[inside, columns_of_s]
            beyond[:, columns] = x[inside.stop :]
            pieces[sectors.start] = sectors, x

        shared(self.count, part, self._chunk(k))
        return list(pieces.values()), by_load

    def _ends(self, run: Pass) -> Array:
        """Ends [x_b(s); x_b(s + 1); -lambda] (2b + t, z, k) of all sectors."""
        b = self._b
        out = np.empty((self.ends, self.count, run.mu.shape[1]))
        out[:b] = run.border
        out[b : 2 * b, :-1] = run.border[:, 1:]
        out[b : 2 * b, -1] = run.border[:, 0]
        np.negative(self._multipliers(run), out=out[2 * b :])
        return out

    def _field(self, run: Pass) -> Array:
        """Field x (3n, z, k) from f, x_b, lambda and mu; overwrites the pieces of the pass."""
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
                    columns_of_s = slice((s - sectors.start) * k, (s + 1 - sectors.start) * k)
                    x[inside, columns_of_s] -= self._local[s].z @ run.mu[self._local[s].at]
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
        """Number of sectors, with k load vectors each, that a thread processes together."""
        return max(1, min(CHUNK // k, self.count // THREADS))
