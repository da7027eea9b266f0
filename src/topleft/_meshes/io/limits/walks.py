"""Counts how often the nodes of a file are reached from its roots, before they are walked.

Input: for each node those below it, which may be shared. Output: numbers of ways; doubling thirty times costs nothing.

Based on: Kahn, A. B., "Topological Sorting of Large Networks", Communications of the ACM, 1962.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from typing import TypeVar

from topleft.errors import MeshError

Node = TypeVar("Node", bound=Hashable)

MANY = 1 << 62
"""Ways beyond are not counted."""


def walks(below: Mapping[Node, Iterable[Node]], roots: Iterable[Node]) -> dict[Node, tuple[int, int]]:
    """The number of ways to each node that is reached, and the number of all their steps."""
    starts = list(roots)
    n_above: dict[Node, int] = dict.fromkeys(starts, 0)
    stack = list(n_above)
    while stack:
        for child in below.get(stack.pop(), ()):
            if child not in n_above:
                n_above[child] = 0
                stack.append(child)
            n_above[child] += 1
    found: dict[Node, tuple[int, int]] = dict.fromkeys(n_above, (0, 0))
    for root in starts:
        found[root] = found[root][0] + 1, found[root][1] + 1
    ready = [node for node, n in n_above.items() if n == 0]
    n_done = 0
    while ready:
        node = ready.pop()
        n_done += 1
        n, n_steps = found[node]
        for child in below.get(node, ()):
            found[child] = min(found[child][0] + n, MANY), min(found[child][1] + n_steps + n, MANY)
            n_above[child] -= 1
            if not n_above[child]:
                ready.append(child)
    if n_done < len(found):
        raise MeshError("a node of it is below itself")
    return found
