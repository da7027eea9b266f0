# Integer edge functions of a triangle, to be stepped. Included after _target.pxi, for the kernels that step them.

from libc.math cimport rint

cdef struct edges:
    int64_t x_first, x_last, y_first, y_last  # pixels to visit: bounding box within the window
    int64_t value[3]  # at the centre of (x_first, y_first), with the bias; a sample is inside where all are >= 0
    int64_t step_x[3]  # one pixel to the right
    int64_t step_y[3]  # one pixel down


cdef inline bint is_top_left(int64_t dx, int64_t dy) noexcept nogil:
    """Tell for an edge of a triangle with positive signed area."""
    return dy < 0 or (dy == 0 and dx > 0)


cdef inline bint is_bottom_right(int64_t dx, int64_t dy) noexcept nogil:
    return dy > 0 or (dy == 0 and dx < 0)


cdef bint set_up_edges(edges *e, target *t, int64_t *x, int64_t *y, int bits, int64_t half, bint bottom_right) noexcept nogil:
    """Set up from three vertices of `bits` fractional bits; pixel centres lie at j * 2**bits + half.

    |x|, |y| < 2**29: no edge function of the bounding box exceeds 2**61. False when nothing is drawn.
    """
    cdef int64_t area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]), dx, dy
    cdef int64_t pixel = <int64_t>1 << bits
    cdef int k, i, j
    if area == 0:
        return False
    if area < 0:
        x[1], y[1], x[2], y[2] = x[2], y[2], x[1], y[1]
    e.x_first, e.x_last = max(t.x0, min(x[0], x[1], x[2]) >> bits), min(t.x1 - 1, max(x[0], x[1], x[2]) >> bits)
    e.y_first, e.y_last = max(t.y0, min(y[0], y[1], y[2]) >> bits), min(t.y1 - 1, max(y[0], y[1], y[2]) >> bits)
    if e.x_first > e.x_last or e.y_first > e.y_last:
        return False
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        dx, dy = x[j] - x[i], y[j] - y[i]
        e.value[k] = dx * (e.y_first * pixel + half - y[i]) - dy * (e.x_first * pixel + half - x[i])
        if not (is_bottom_right(dx, dy) if bottom_right else is_top_left(dx, dy)):
            e.value[k] -= 1
        e.step_x[k], e.step_y[k] = -dy * pixel, dx * pixel
    return True


cdef bint snap_edges(
    edges *e, target *t, const double *a, const double *b, const double *c, int subpixel_bits, bint bottom_right
) noexcept nogil:
    """Set up from vertices snapped to `subpixel_bits`, as the library snaps them; one bit more where there is none,
    so that a pixel centre is an integer."""
    cdef int bits = max(subpixel_bits, 1)
    cdef double scale = <double>(1 << subpixel_bits)
    cdef int64_t spread = 1 << (bits - subpixel_bits)
    cdef int i
    cdef int64_t x[3]
    cdef int64_t y[3]
    x[0], x[1], x[2] = <int64_t>rint(a[0] * scale), <int64_t>rint(b[0] * scale), <int64_t>rint(c[0] * scale)
    y[0], y[1], y[2] = <int64_t>rint(a[1] * scale), <int64_t>rint(b[1] * scale), <int64_t>rint(c[1] * scale)
    for i in range(3):
        x[i], y[i] = x[i] * spread, y[i] * spread
    return set_up_edges(e, t, x, y, bits, <int64_t>1 << (bits - 1), bottom_right)
