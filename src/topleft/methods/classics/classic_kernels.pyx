# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False, cdivision=True, embedsignature=False
# cython: freethreading_compatible=True
# cython: auto_pickle=False, emit_code_comments=False
"""The classics as one compiled module: arrays in, a loop over triangles, and the fill of the method that is named.

A method is a file beside this one.  It has its variants in FORMS, in the order of its own constants, and a function
`fill_NAME` that draws one triangle.  All are one module since a module by itself takes longer to compile than a method.
"""

import numpy as np

FORMS: dict[str, tuple[str, ...]] = {}

include "_target.pxi"
include "_edges.pxi"
include "bresenham_scanline.pxi"
include "edge_increment.pxi"
include "float_barycentric.pxi"
include "lerp_scanline.pxi"
include "point_in_triangle.pxi"
include "row_crossing.pxi"
include "zigzag.pxi"

ctypedef void (*filler)(target *, const double *, const double *, const double *, int, int) noexcept nogil

cdef filler find_filler(str method) except NULL:
    if method == "bresenham_scanline":
        return fill_bresenham_scanline
    if method == "edge_increment":
        return fill_edge_increment
    if method == "float_barycentric":
        return fill_float_barycentric
    if method == "lerp_scanline":
        return fill_lerp_scanline
    if method == "point_in_triangle":
        return fill_point_in_triangle
    if method == "row_crossing":
        return fill_row_crossing
    if method == "zigzag":
        return fill_zigzag
    raise ValueError(f"method must be one of {', '.join(map(repr, FORMS))}, got {method!r}")


def draw(str method, vertices, triangles, pixels, tuple window, int sink, str variant="", int subpixel_bits=8):
    """Draw triangles in order over a cleared window (x, y, width, height) of the picture."""
    cdef filler fill_triangle = find_filler(method)
    cdef int form = FORMS[method].index(variant)
    cdef Py_ssize_t i, n, step
    cdef Py_buffer points, corners, bytes_drawn
    cdef const double *xy
    cdef const int32_t *corner
    cdef target t
    t.x0, t.y0 = window[:2]
    t.x1, t.y1 = t.x0 + window[2], t.y0 + window[3]
    t.sink = sink
    xy = <const double *>lend(vertices, &points, sizeof(double), 2, 0)
    try:
        corner = <const int32_t *>lend(triangles, &corners, sizeof(int32_t), 3, 0)
        try:
            t.pixels = lend(pixels, &bytes_drawn, 1, 0, PyBUF_WRITABLE)
            n = corners.shape[0] if bytes_drawn.len else 0
            step = points.shape[1]
            with nogil:
                for i in range(n):
                    t.label = <int32_t>i
                    fill_triangle(
                        &t, xy + step * corner[0], xy + step * corner[1], xy + step * corner[2], form, subpixel_bits
                    )
                    corner += corners.shape[1]
            PyBuffer_Release(&bytes_drawn)
        finally:
            PyBuffer_Release(&corners)
    finally:
        PyBuffer_Release(&points)
