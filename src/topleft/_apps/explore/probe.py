"""Says why a pixel is whose: edge values, top and left edges, the owner, who else could be, depth and barycentrics.

In: a state, a pixel of its window, which sample of it. Out: a sentence or two, and a row for each triangle near by.
All is computed in integers and fractions, by `topleft.methods.reference`; what a method makes of the pixel is drawn.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Any, NamedTuple

from topleft import overdraw
from topleft._apps.explore.pixels import EXACT, css, triangle_colors
from topleft._apps.explore.session import Reply, Request, Session
from topleft._apps.explore.state import PixelState, pair, parse_state
from topleft.methods import CLASSICS, reference
from topleft.methods.reference import Fragment, edge_function, is_top_left, sampling

MAX_ROWS = 6
"""Triangles that are told of: those that have the sample, then those that nearly have."""

MAX_DRAWN = 64
"""Triangles that are drawn one by one to find out who draws a pixel how often."""


class Edge(NamedTuple):
    """An edge of a triangle at a sample: its vertices, which side it is, and twice a signed area in pixels."""

    ends: tuple[int, int]
    kind: str
    value: Fraction

    @property
    def is_owned(self) -> bool:
        """Whether a sample on it belongs to the triangle."""
        return self.kind in ("top", "left")


class Verdict(NamedTuple):
    """What a triangle is at a sample."""

    triangle: int
    edges: tuple[Edge, Edge, Edge]
    fragment: Fragment

    @property
    def is_covered(self) -> bool:
        """Whether the sample belongs to the triangle."""
        return all(edge.value > 0 or (edge.value == 0 and edge.is_owned) for edge in self.edges)

    @property
    def is_touched(self) -> bool:
        """Whether the sample is inside the triangle or on one of its edges."""
        return all(edge.value >= 0 for edge in self.edges)


def verdicts(state: PixelState, pixel: tuple[int, int], sample: tuple[int, int], bits: Any) -> list[Verdict]:
    """Return what each triangle with an area is at a sample, of vertices that are snapped to so many bits."""
    scale = 1 if bits == "exact" else 2**bits
    at = tuple(Fraction(16 * (pixel[k] + state.origin[k]) + 8 + sample[k], 16) for k in range(2))
    found = []
    for piece in reference.pieces(state.vertices, state.triangles, state.size, subpixel_bits=bits, cull=state.cull):
        corners = [tuple(Fraction(v) / scale for v in vertex.xy_fx) for vertex in piece.vertices]
        numbers = state.triangles[piece.triangle].tolist()
        is_clockwise = edge_function(*corners) > 0
        edges = []
        for k in range(3):  # opposite the first, second and third vertex
            i, j = ((k + 1) % 3, (k + 2) % 3) if is_clockwise else ((k + 2) % 3, (k + 1) % 3)
            value = edge_function(corners[i], corners[j], at)
            edges.append(Edge((numbers[i], numbers[j]), side(corners[i], corners[j]), value))
        fragment = Fragment(pixel[1], pixel[0], piece, tuple(edge.value for edge in edges))  # type: ignore[arg-type]
        found.append(Verdict(piece.triangle, (edges[0], edges[1], edges[2]), fragment))
    return found


def side(a: Any, b: Any) -> str:
    """Which side of its triangle an edge is, of those whose signed area is positive."""
    if a[1] == b[1]:
        return "top" if is_top_left(a, b) else "bottom"
    return "left" if is_top_left(a, b) else "right"


def probe(_: Session, request: Request) -> Reply:
    """Return why a pixel is whose."""
    state = parse_state(request.get("state"))
    x, y = pair("pixel", request.get("pixel"), 0, max(state.size) - 1)
    if x >= state.size[0] or y >= state.size[1]:
        raise ValueError(f"pixel must lie in the window of {state.size}, got {x}, {y}")
    positions = sampling.SAMPLE_POSITIONS[
        int(state.sampling.removeprefix("msaa")) if state.sampling.startswith("msaa") else 1
    ]
    k = request.get("sample", 0)
    if type(k) is not int or not 0 <= k < len(positions):
        raise ValueError(f"sample must be from 0 to {len(positions) - 1}, got {str(k)[:20]}")
    method = request.get("method", state.method)
    bits = bits_of(state, method)
    found = sorted(verdicts(state, (x, y), positions[k], bits), key=nearness)
    place = (x + state.origin[0], y + state.origin[1])
    owner = winner([one for one in found if one.is_covered], state)
    others = [name for name in dict.fromkeys((method, state.method, state.other)) if name in CLASSICS]
    stories = [classic_story(name, drawn_by(state, (x, y), name), owner) for name in others]
    return Reply(
        {
            "pixel": place,
            "sentences": [*sentences(state, found, owner, place, k), *(story for story in stories if story)],
            "owner": -1 if owner is None else owner.triangle,
            "rows": [as_row(one, state, owner) for one in found[:MAX_ROWS]],
            "n_more": max(0, len(found) - MAX_ROWS),
        }
    )


def bits_of(state: PixelState, method: Any) -> Any:
    """The grid that a method snaps vertices to; "exact" for none."""
    if method == EXACT:
        return "exact"
    if method in CLASSICS and not CLASSICS[method].has_subpixel_bits:
        return 8
    return state.options(method).get("subpixel_bits", 8)


def nearness(one: Verdict) -> tuple[bool, bool, Fraction]:
    """The order in which triangles are told of: those that have the sample, touch it, are near it."""
    return not one.is_covered, not one.is_touched, -min(edge.value for edge in one.edges)


def winner(covered: list[Verdict], state: PixelState) -> Verdict | None:
    """The triangle that shows, of those that have the sample."""
    in_order = sorted(covered, key=lambda one: one.triangle)
    if not in_order:
        return None
    if not state.has_depth:
        return in_order[-1]
    toward = -1 if state.depth_test == "less" else 1
    return max(in_order, key=lambda one: toward * reference.round_to_float32(one.fragment.depth()))


def drawn_by(state: PixelState, pixel: tuple[int, int], method: str) -> dict[int, int] | None:
    """Return how often a classic draws a pixel for each triangle; None when that cannot be told."""
    if len(state.triangles) > MAX_DRAWN:
        return None
    options = {**state.options(method), "origin": (pixel[0] + state.origin[0], pixel[1] + state.origin[1])}
    found = {}
    for i in range(len(state.triangles)):
        try:
            n = int(overdraw(state.vertices, state.triangles[i : i + 1], (1, 1), **options)[0, 0])
        except ValueError:  # a vertex beyond its range
            return None
        if n:
            found[i] = n
    return found


# In words


def sentences(
    state: PixelState, found: list[Verdict], owner: Verdict | None, pixel: tuple[int, int], k: int
) -> Iterator[str]:
    """Yield why the pixel is whose."""
    what = f"The {f'sample {k}' if state.sampling.startswith('msaa') else 'centre'} of pixel ({pixel[0]}, {pixel[1]})"
    on_edge = [one for one in found if one.is_touched and any(edge.value == 0 for edge in one.edges)]
    covered = [one for one in found if one.is_covered]
    if on_edge:
        yield f"{what} lies on an edge. " + " ".join(edge_story(one) for one in on_edge[:4])
    elif owner is not None:
        yield f"{what} lies inside triangle {owner.triangle}: all three edge values are positive."
    else:
        yield f"{what} lies in no triangle: each has an edge value below zero."
    if len(covered) > 1 and owner is not None:
        others = listed([one.triangle for one in covered if one is not owner])
        why = "it is nearer" if state.has_depth else "it is drawn last"
        yield f"Triangle {owner.triangle} shows because {why}; {others} {'is' if len(covered) == 2 else 'are'} hidden."


def edge_story(one: Verdict) -> str:
    """What the edges through a sample are for a triangle."""
    through = [edge for edge in one.edges if edge.value == 0]
    ends = " and ".join(map(named, through))
    kinds = " and a ".join(edge.kind for edge in through)
    story = f"Edge {ends} is a {kinds} edge" if len(through) == 1 else f"Edges {ends} are a {kinds} edge"
    return (
        f"{story} of triangle {one.triangle}, so the pixel {'belongs' if one.is_covered else 'does not belong'} to it."
    )


def classic_story(method: str, times: dict[int, int] | None, owner: Verdict | None) -> str:
    """What a classic makes of the pixel, beside the exact rule; nothing where that is not known."""
    if times is None:
        return ""
    n = sum(times.values())
    rule = "no triangle should have it" if owner is None else f"by the exact rule it is triangle {owner.triangle}'s"
    if not n:
        return f"{method} leaves it out" + (", as it should." if owner is None else f"; {rule}: a gap.")
    drawn = " and ".join(f"triangle {i}" + (f" ({k} times)" if k > 1 else "") for i, k in times.items())
    if owner is not None and times == {owner.triangle: 1}:
        return f"{method} draws it once, for triangle {owner.triangle}, as it should."
    return f"{method} draws it {'once' if n == 1 else f'{n} times'}, for {drawn}; {rule}."


def listed(numbers: list[int]) -> str:
    """Triangles by their numbers."""
    head = ", ".join(map(str, numbers[:4])) + (" and others" if len(numbers) > 4 else "")
    return ("triangle " if len(numbers) == 1 else "triangles ") + head


def as_row(one: Verdict, state: PixelState, owner: Verdict | None) -> dict[str, Any]:
    """What the page writes of a triangle."""
    verdict = (
        "owner" if one is owner else "hidden" if one.is_covered else "on its edge" if one.is_touched else "outside"
    )
    return {
        "triangle": one.triangle,
        "color": css(triangle_colors(one.triangle + 1)[-1]),
        "verdict": "owner" if one is owner else verdict,
        "edges": [
            {"ends": named(edge), "kind": edge.kind, "value": number(edge.value), "exact": str(edge.value)}
            for edge in one.edges
        ],
        "depth": number(one.fragment.depth()) if state.has_depth else None,
        "weights": ", ".join(number(weight) for weight in one.fragment.weights()),
    }


def named(edge: Edge) -> str:
    """An edge by its vertices."""
    return f"{min(edge.ends)}\N{EN DASH}{max(edge.ends)}"


def number(value: Fraction) -> str:
    """A fraction in at most six digits; one that is not zero is never written as 0."""
    return "0" if value == 0 else f"{float(value):.6g}"


HANDLERS = {"pixels.probe": probe}
