# Point in triangle: every pixel of the bounding box, three cross products each.
#
# In: vertices, truncated to pixels.  Out: the pixels whose three cross products have one sign, zero included, so either
# winding will do and edges belong to both their triangles.  "top-left" turns the triangle one way round and takes one
# unit off the edges that are neither top nor left.
#
# Based on: xterminal86, Software 3D renderer tutorial, part 3: Scanline is a lie, 2023 (this form);
# J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988 (where it comes from).

FORMS["point_in_triangle"] = ("", "top-left")
cdef enum:
    INCLUSIVE = 0
    TOP_LEFT = 1


cdef inline int64_t cross_of_ints(int64_t ax, int64_t ay, int64_t bx, int64_t by, int64_t x, int64_t y) noexcept nogil:
    # |coordinate| < 2**29: each product is below 2**60
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax)


cdef inline int64_t bias(int64_t ax, int64_t ay, int64_t bx, int64_t by) noexcept nogil:
    """Return 0 for a top or left edge of a triangle that turns clockwise as seen, -1 for the others."""
    return 0 if by < ay or (by == ay and bx > ax) else -1


cdef void fill_point_in_triangle(
    target *t, const double *a, const double *b, const double *c, int form, int subpixel_bits
) noexcept nogil:
    cdef int64_t ax = <int64_t>a[0], ay = <int64_t>a[1], bx = <int64_t>b[0], by = <int64_t>b[1]
    cdef int64_t cx = <int64_t>c[0], cy = <int64_t>c[1]
    cdef int64_t x, y, w0, w1, w2, bias0 = 0, bias1 = 0, bias2 = 0
    if form == TOP_LEFT:
        if cross_of_ints(ax, ay, bx, by, cx, cy) < 0:
            bx, by, cx, cy = cx, cy, bx, by
        bias0, bias1, bias2 = bias(ax, ay, bx, by), bias(bx, by, cx, cy), bias(cx, cy, ax, ay)
    for y in range(max(t.y0, min(ay, by, cy)), min(t.y1, max(ay, by, cy) + 1)):
        for x in range(max(t.x0, min(ax, bx, cx)), min(t.x1, max(ax, bx, cx) + 1)):
            w0 = cross_of_ints(ax, ay, bx, by, x, y) + bias0
            w1 = cross_of_ints(bx, by, cx, cy, x, y) + bias1
            w2 = cross_of_ints(cx, cy, ax, ay, x, y) + bias2
            if (w0 >= 0 and w1 >= 0 and w2 >= 0) or (form == INCLUSIVE and w0 <= 0 and w1 <= 0 and w2 <= 0):
                put(t, x, y)
