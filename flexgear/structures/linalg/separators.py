r"""The smallest set of nodes that separates two sides of a graph, between them, by maximum flow.

Every node that may be taken is split into an entry and an exit joined by an edge of capacity one,
edges of the graph join exits to entries without limit. By Menger's theorem the largest flow from
the low to the high side is the size of the smallest separator; it stands where the flow left no
way from an entry, which can be reached, to its exit.
Source: Menger 1927, Fund. Math. 10:96; Ford, Fulkerson 1956, Canad. J. Math. 8:399.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

Ints = NDArray[np.int64]

LOW, HIGH = -2, -3  # sides of nodes that are not to be taken
_NO_LIMIT = 1 << 20


def separator(side: Ints, rows: Ints, columns: Ints) -> NDArray[np.int8] | None:
    """For every node (n,) 1 if it is low, 2 if it is high, 3 if it separates; None if none can.

    side: (n,) LOW, HIGH, or 0 for nodes that may be taken; rows, columns: ends of all edges, both
    ways.
    """
    if np.any((side[rows] == LOW) & (side[columns] == HIGH)):
        return None
    free = np.flatnonzero(side == 0)
    count = len(free)
    number = side.copy()
    number[free] = np.arange(count)
    mine = (number[rows] >= 0) & (rows != columns)
    begin, end = number[rows[mine]], number[columns[mine]]
    from_low, to_high = np.unique(begin[end == LOW]), np.unique(begin[end == HIGH])
    between = end >= 0
    begin, end = begin[between], end[between]
    source, sink, entries = 2 * count, 2 * count + 1, 2 * np.arange(count)
    heads = np.concatenate(
        [entries, 2 * begin + 1, np.full(len(from_low), source), 2 * to_high + 1]
    )
    tails = np.concatenate([entries + 1, 2 * end, 2 * from_low, np.full(len(to_high), sink)])
    room = np.full(len(heads), _NO_LIMIT, dtype=np.int32)
    room[:count] = 1
    network = sp.csr_matrix((room, (heads, tails)), (sink + 1, sink + 1))
    left = network - maximum_flow(network, source, sink).flow
    left.data[left.data < 0] = 0
    left.eliminate_zeros()
    seen = np.zeros(sink + 1, dtype=bool)
    seen[breadth_first_order(left, source, return_predecessors=False)] = True
    reached, passed = seen[:source:2], seen[1:source:2]
    out = np.where(side == LOW, 1, 2).astype(np.int8)
    out[free] = np.where(passed, 1, np.where(reached, 3, 2))
    return out
