# Edge increment: integer edge functions, set up once a triangle, then stepped by additions along rows and columns.
#
# In: vertices, snapped to sub-pixels ("integer": truncated to pixels, which are sampled at their corner).  Out: the pixels
# whose three edge functions are >= 0 after one unit was taken off the edges that own nothing.  "bottom-right" takes it off
# the top and left edges: as watertight, but other pixels.
#
# Based on: J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988;
# F. Giesen, Optimizing the basic rasterizer, 2013 (the steps and the bias);
# K. Dyrkorn, A fast and precise triangle rasterizer, 2022 (the variant that leaves top and left edges out).

FORMS["edge_increment"] = ("", "integer", "bottom-right")
cdef enum:
    SUBPIXEL = 0
    INTEGER = 1
    BOTTOM_RIGHT = 2


cdef void fill_edge_increment(
    target *t, const double *a, const double *b, const double *c, int form, int subpixel_bits
) noexcept nogil:
    cdef edges e
    cdef int64_t px[3]
    cdef int64_t py[3]
    cdef int64_t x, y, w0, w1, w2
    if form == INTEGER:
        px[0], px[1], px[2] = <int64_t>a[0], <int64_t>b[0], <int64_t>c[0]
        py[0], py[1], py[2] = <int64_t>a[1], <int64_t>b[1], <int64_t>c[1]
        if not set_up_edges(&e, t, px, py, 0, 0, False):
            return
    elif not snap_edges(&e, t, a, b, c, subpixel_bits, form == BOTTOM_RIGHT):
        return
    for y in range(e.y_first, e.y_last + 1):
        w0, w1, w2 = e.value[0], e.value[1], e.value[2]
        for x in range(e.x_first, e.x_last + 1):
            if (w0 | w1 | w2) >= 0:  # no sign bit in any of them
                put(t, x, y)
            w0, w1, w2 = w0 + e.step_x[0], w1 + e.step_x[1], w2 + e.step_x[2]
        e.value[0], e.value[1], e.value[2] = e.value[0] + e.step_y[0], e.value[1] + e.step_y[1], e.value[2] + e.step_y[2]
