"""The registry: the only list of the ways to fill that the library has."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["METHODS", "Method", "production_method"]


@dataclass(frozen=True, slots=True)
class Method:
    """One way to fill, and what it claims.

    Attributes
    ----------
    name : str
        What ``method=`` calls it.
    summary : str
        How it finds the covered samples.
    source : str
        Author, title, year.
    code : int
        `tl_method` in ``csrc/topleft.h``.
    """

    name: str
    summary: str
    source: str
    code: int


METHODS = {
    method.name: method
    for method in (
        Method("auto", "the cheaper of edge and scanline for each triangle", "", 0),
        Method(
            "edge",
            "integer edge functions, stepped by additions, one test a sample",
            "J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988",
            1,
        ),
        Method(
            "scanline",
            "row ends by one floor division an edge, then stepped quotient and remainder",
            "J. E. Bresenham, Algorithm for computer control of a digital plotter, 1965",
            2,
        ),
    )
}


def production_method(name: object) -> int:
    """Return the code of an exact method.

    Raises
    ------
    ValueError
        If there is no such method.
    """
    method = METHODS.get(name) if isinstance(name, str) else None
    if method is None:
        raise ValueError(f"method must be one of {', '.join(map(repr, METHODS))}, got {name!r}")
    return method.code
