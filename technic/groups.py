"""Connected groups of numbered things."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

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
    heads = {m: m for m in sorted(members)}

    def head(member: int) -> int:
        while heads[member] != member:
            # every visit halves the way for the next
            heads[member] = member = heads[heads[member]]
        return member

    for a, b in edges:
        first, second = head(a), head(b)
        if first != second:
            heads[max(first, second)] = min(first, second)
    groups: dict[int, list[int]] = {}
    for member in heads:
        groups.setdefault(head(member), []).append(member)
    return [tuple(g) for g in groups.values()]
