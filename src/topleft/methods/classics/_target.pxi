# What the classics share: memory in, pixels out. Included before them by classic_kernels.pyx.
#
# In: pixel-space vertices, finite and within the method's limit; indices inside them. Out: a window of the picture.
# `plot` and `fill_span` clamp to the window; `put` is for loops that are clamped already. Nothing else writes.

from cpython.buffer cimport PyBUF_C_CONTIGUOUS, PyBUF_WRITABLE, PyBuffer_Release, PyObject_GetBuffer
from libc.math cimport floor
from libc.stdint cimport int32_t, int64_t, uint8_t

cdef enum:  # Sink in options.py
    MASK = 0
    COUNT = 1
    LABEL = 2

cdef struct target:
    void *pixels  # uint8 for MASK, int32 otherwise
    int sink
    int32_t label  # of the triangle being drawn
    int64_t x0, y0, x1, y1  # window of the whole picture, pixels, half-open


cdef inline void put(target *t, int64_t x, int64_t y) noexcept nogil:
    """Draw one pixel of the window."""
    cdef int64_t i = (y - t.y0) * (t.x1 - t.x0) + x - t.x0
    if t.sink == MASK:
        (<uint8_t *>t.pixels)[i] = 1
    elif t.sink == COUNT:
        (<int32_t *>t.pixels)[i] += 1
    else:
        (<int32_t *>t.pixels)[i] = t.label


cdef inline void plot(target *t, int64_t x, int64_t y) noexcept nogil:
    """Draw one pixel, if it lies in the window."""
    if t.x0 <= x < t.x1 and t.y0 <= y < t.y1:
        put(t, x, y)


cdef inline void fill_span(target *t, int64_t y, int64_t first, int64_t last) noexcept nogil:
    """Draw the pixels first to last of a row, both of them included."""
    cdef int64_t i, row
    cdef uint8_t *mask = <uint8_t *>t.pixels  # bytes may overlay `t` itself: read it once, or there is no memset
    cdef int32_t *cells = <int32_t *>t.pixels
    cdef int32_t label = t.label
    if y < t.y0 or y >= t.y1:
        return
    row = (y - t.y0) * (t.x1 - t.x0)
    first, last = row + max(first, t.x0) - t.x0, row + min(last, t.x1 - 1) - t.x0
    if t.sink == MASK:
        for i in range(first, last + 1):
            mask[i] = 1
    elif t.sink == COUNT:
        for i in range(first, last + 1):
            cells[i] += 1
    else:
        for i in range(first, last + 1):
            cells[i] = label


cdef inline int64_t pixel_floor(double value, int64_t smallest, int64_t largest) noexcept nogil:
    """Return the floor of a finite or infinite value, clamped before it becomes an integer."""
    if value <= <double>smallest:
        return smallest
    return largest if value >= <double>largest else <int64_t>floor(value)


cdef void *lend(object array, Py_buffer *view, Py_ssize_t item_size, int n_columns, int flags) except? NULL:
    """Return the memory of a contiguous array of rows of at least `n_columns` items (0: one dimension).

    Typed memoryviews would do the same, and be most of the module.
    """
    PyObject_GetBuffer(array, view, PyBUF_C_CONTIGUOUS | flags)
    if view.itemsize != item_size or view.ndim != (2 if n_columns else 1) or (n_columns and view.shape[1] < n_columns):
        PyBuffer_Release(view)
        raise ValueError(f"a buffer must have items of {item_size} bytes in rows of {n_columns or 'one'}")
    return view.buf
