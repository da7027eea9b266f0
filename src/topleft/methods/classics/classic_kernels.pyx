# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False, cdivision=True, embedsignature=False
# cython: freethreading_compatible=True
# cython: auto_pickle=False, emit_code_comments=False
"""The classics as a compiled module: calls the methods of classics.h for the triangles of arrays."""

import numpy as np

from cpython.buffer cimport PyBUF_C_CONTIGUOUS, PyBUF_WRITABLE, PyBuffer_Release, PyObject_GetBuffer
from libc.stdint cimport int32_t, int64_t

cdef extern from "classics.h":
    enum: CLASSIC_N, CLASSIC_MOST_FORMS
    ctypedef int classic_sink
    ctypedef struct classic_target:
        void *pixels
        classic_sink sink
        int64_t x0, y0, x1, y1
    ctypedef struct classic_point:
        int64_t x, y
    ctypedef struct classic_line:
        int64_t x, y, n_left
    ctypedef struct classic:
        const char *name
        const char *forms[CLASSIC_MOST_FORMS]
    const classic CLASSICS[CLASSIC_N]
    void draw_classic(int method, int form, int subpixel_bits, const double *vertices, int64_t stride, const int32_t *triangles,
                      int64_t n, classic_target *t) noexcept nogil
    classic_line start_line(classic_point a, classic_point b) noexcept nogil
    void step_line(classic_line *l) noexcept nogil

cdef extern from "trace.h":
    ctypedef struct classic_kind:
        const char *name
        const char *side
        int is_real
        const char *numbers
    const classic_kind CLASSIC_KINDS[]
    int64_t trace_steps(int method, int form, int subpixel_bits, const double *vertices, int64_t stride, const int32_t *triangles,
                        int64_t n, const int64_t *window, int32_t *counts, int64_t *words, int64_t n_words) noexcept nogil

#: The variants of each method, in the order of their numbers; methods in the order of theirs.
FORMS: dict[str, tuple[str, ...]] = {
    CLASSICS[i].name.decode(): tuple([
        CLASSICS[i].forms[k].decode() for k in range(CLASSIC_MOST_FORMS) if CLASSICS[i].forms[k] != NULL
    ])
    for i in range(CLASSIC_N)
}


cdef void *lend(object array, Py_buffer *view, Py_ssize_t item_size, int n_columns, int flags) except? NULL:
    """Return the memory of a contiguous array of rows of at least `n_columns` items (0: one dimension).

    Typed memoryviews would do this, too, but be most of the module.
    """
    PyObject_GetBuffer(array, view, PyBUF_C_CONTIGUOUS | flags)
    if view.itemsize != item_size or view.ndim != (2 if n_columns else 1) or (n_columns and view.shape[1] < n_columns):
        PyBuffer_Release(view)
        raise ValueError(f"a buffer must have items of {item_size} bytes in rows of {n_columns or 'one'}")
    return view.buf


def draw(str method, vertices, triangles, pixels, tuple window, int sink, str variant="", int subpixel_bits=8):
    """Draw triangles in order over a cleared window (x, y, width, height) of the picture."""
    cdef int form, number
    cdef Py_buffer points, corners, bytes_drawn
    cdef const double *xy
    cdef const int32_t *corner
    cdef classic_target t
    if method not in FORMS:
        raise ValueError(f"method must be one of {', '.join(map(repr, FORMS))}, got {method!r}")
    number, form = list(FORMS).index(method), FORMS[method].index(variant)
    t.x0, t.y0 = window[:2]
    t.x1, t.y1 = t.x0 + window[2], t.y0 + window[3]
    t.sink = <classic_sink>sink
    xy = <const double *>lend(vertices, &points, sizeof(double), 2, 0)
    try:
        corner = <const int32_t *>lend(triangles, &corners, sizeof(int32_t), 3, 0)
        try:
            t.pixels = lend(pixels, &bytes_drawn, 1, 0, PyBUF_WRITABLE)
            if bytes_drawn.len:
                with nogil:
                    draw_classic(number, form, subpixel_bits, xy, points.shape[1], corner, corners.shape[0], &t)
            PyBuffer_Release(&bytes_drawn)
        finally:
            PyBuffer_Release(&corners)
    finally:
        PyBuffer_Release(&points)


def list_kinds():
    """Return the kinds of steps by their number: name, side, whether numbers are real, and their names and lengths."""
    found, i = [], 0
    while CLASSIC_KINDS[i].name != NULL:
        numbers = [word.split(":") for word in CLASSIC_KINDS[i].numbers.decode().split(",") if word]
        found.append((CLASSIC_KINDS[i].name.decode(), CLASSIC_KINDS[i].side.decode(), bool(CLASSIC_KINDS[i].is_real),
                      [(name, int(n)) for name, n in numbers]))
        i += 1
    return found


def trace(str method, vertices, triangles, counts, tuple window, words, int subpixel_bits=8):
    """Draw counts over a cleared window, write the steps as words of int64 (steps.h), and return how many there are.

    The method is a classic with its variant, or "edge" or "scanline", as production walks.
    """
    cdef int form, number, n_lent = 0
    cdef int64_t n
    cdef int64_t[4] place
    cdef Py_buffer[4] lent
    name, _, variant = method.partition("/")
    place = window
    if name in FORMS:
        number, form = list(FORMS).index(name), FORMS[name].index(variant)
    else:
        number, form = CLASSIC_N, ("edge", "scanline").index(method)
    try:
        for array, item_size, n_columns in ((vertices, 8, 2), (triangles, 4, 3), (counts, 4, 1), (words, 8, 0)):
            lend(array, &lent[n_lent], item_size, n_columns, PyBUF_WRITABLE if n_lent > 1 else 0)
            n_lent += 1
        with nogil:
            n = trace_steps(number, form, subpixel_bits, <const double *>lent[0].buf, lent[0].shape[1],
                            <const int32_t *>lent[1].buf, lent[1].shape[0], place, <int32_t *>lent[2].buf,
                            <int64_t *>lent[3].buf, lent[3].shape[0])
    finally:
        for i in range(n_lent):
            PyBuffer_Release(&lent[i])
    return n


def line_pixels(int64_t x0, int64_t y0, int64_t x1, int64_t y1):
    """Return the (N, 2) pixels of a line, from its upper end down."""
    cdef classic_line l
    cdef classic_point a, b
    cdef Py_ssize_t i
    cdef Py_buffer view
    cdef int64_t *pixels
    a.x, a.y, b.x, b.y = x0, y0, x1, y1
    l = start_line(a, b)
    made = np.empty((l.n_left, 2), np.int64)
    pixels = <int64_t *>lend(made, &view, sizeof(int64_t), 2, PyBUF_WRITABLE)
    for i in range(view.shape[0]):
        pixels[2 * i], pixels[2 * i + 1] = l.x, l.y
        step_line(&l)
    PyBuffer_Release(&view)
    return made
