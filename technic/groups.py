"""Connected groups of numbered things."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

__all__ = ["connected_groups"]


def connected_groups(
    members: Sequence[int], edges: Iterable[tuple[int, int]]
) -> list[tuple[int, ...]]:
    """Return the groups of `members` that `edges` tie together, each sorted, by first member.

    Parameters
    ----------
    members : sequence of int
        Distinct; need not be consecutive.
    edges : iterable of (int, int)
        Between members.

    Examples
    --------
    >>> connected_groups([7, 3, 5, 4], [(3, 5), (7, 7)])
    [(3, 5), (4,), (7,)]
    """
    order = sorted(members)
    place = {m: k for k, m in enumerate(order)}
    pairs = np.array([(place[a], place[b]) for a, b in edges], dtype=np.int64).reshape(-1, 2)
    shape = (len(order), len(order))
    graph = sparse.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=shape)
    _, labels = connected_components(graph, directed=False)
    groups: dict[int, list[int]] = {}
    for member, label in zip(order, labels, strict=True):
        groups.setdefault(int(label), []).append(member)
    return sorted(tuple(g) for g in groups.values())
