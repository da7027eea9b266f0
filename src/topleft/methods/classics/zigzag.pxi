# Zigzag: integer edge functions again, but the walk turns round at the triangle's sides instead of the box's.
#
# In: vertices, snapped to sub-pixels.  Out: the pixels that edge_increment finds, in another order: one row to the right,
# the next to the left.  A row is left when an edge function is negative, and will stay so, both there and in the row below;
# then whatever the next row covers lies the other way.
#
# Based on: J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988 (smarter traversal, figure 5);
# T. Akenine-Moeller, J. Stroem, Graphics for the Masses, 2003 (the zigzag by name).

FORMS["zigzag"] = ("",)


cdef inline bint is_behind(const int64_t *w, const int64_t *step_x, const int64_t *step_y, int64_t way) noexcept nogil:
    """Tell whether nothing is covered from here on, neither in this row nor in the next (step_y NULL: in this one)."""
    cdef int k
    cdef bint here = False, below = step_y == NULL
    for k in range(3):
        if step_x[k] * way <= 0:
            here = here or w[k] < 0
            below = below or w[k] + step_y[k] < 0
    return here and below


cdef void fill_zigzag(
    target *t, const double *a, const double *b, const double *c, int form, int subpixel_bits
) noexcept nogil:
    cdef edges e
    cdef int64_t w[3]
    cdef int64_t x, y, way
    cdef int k
    if not snap_edges(&e, t, a, b, c, subpixel_bits, False):
        return
    # Start below the topmost vertex, and step to the left until the first row lies to the right.
    x = pixel_floor(a[0] if a[1] <= min(b[1], c[1]) else b[0] if b[1] <= c[1] else c[0], e.x_first, e.x_last)
    for k in range(3):
        w[k] = e.value[k] + (x - e.x_first) * e.step_x[k]
    while x > e.x_first and not is_behind(w, e.step_x, NULL, -1):
        x -= 1
        for k in range(3):
            w[k] -= e.step_x[k]
    way = 1
    for y in range(e.y_first, e.y_last + 1):
        while True:
            if (w[0] | w[1] | w[2]) >= 0:
                put(t, x, y)
            if x == (e.x_last if way > 0 else e.x_first) or is_behind(w, e.step_x, e.step_y, way):
                break
            x += way
            for k in range(3):
                w[k] += way * e.step_x[k]
        way = -way
        for k in range(3):
            w[k] += e.step_y[k]
