# Row crossing: each row asks the three edges where it crosses them, and fills from the least answer to the greatest.
#
# In: vertices, truncated to pixels.  An edge answers in float32, rounded to the nearest pixel, for the rows between its
# ends, both included; a horizontal one does not answer, so a horizontal line vanishes and a vertical one stays.  Out: spans
# that include both ends.  "zero-area-test" drops triangles without area first; "cull-back" and "cull-front" drop those, too,
# and one winding (the front is counter-clockwise as seen).
#
# Based on: C. Wylie, G. Romney, D. Evans, A. Erdahl, Half-tone perspective drawings by computer, 1967;
# D. R. Finley, Efficient Polygon Fill Algorithm, 2007 (each row asks each edge).

from libc.math cimport floorf

FORMS["row_crossing"] = ("", "zero-area-test", "cull-back", "cull-front")
cdef enum:
    ALL = 0
    WITH_AREA = 1
    FRONT = 2
    BACK = 3

cdef struct span:
    int64_t first, last


cdef inline void ask(
    span *s, int64_t y, int64_t ax, int64_t ay, int64_t bx, int64_t by
) noexcept nogil:
    cdef int64_t x
    if ay == by or y < min(ay, by) or y > max(ay, by):
        return
    x = <int64_t>floorf(<float>ax + <float>(y - ay) * <float>(bx - ax) / <float>(by - ay) + <float>0.5)
    s.first, s.last = min(s.first, x), max(s.last, x)


cdef void fill_row_crossing(
    target *t, const double *a, const double *b, const double *c, int form, int subpixel_bits
) noexcept nogil:
    cdef int64_t ax = <int64_t>a[0], ay = <int64_t>a[1], bx = <int64_t>b[0], by = <int64_t>b[1]
    cdef int64_t cx = <int64_t>c[0], cy = <int64_t>c[1]
    cdef int64_t area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax), y
    cdef span s
    if (form != ALL and area == 0) or (form == FRONT and area > 0) or (form == BACK and area < 0):
        return
    for y in range(max(t.y0, min(ay, by, cy)), min(t.y1, max(ay, by, cy) + 1)):
        s.first, s.last = t.x1, t.x0 - 1  # empty
        ask(&s, y, ax, ay, bx, by)
        ask(&s, y, bx, by, cx, cy)
        ask(&s, y, cx, cy, ax, ay)
        fill_span(t, y, s.first, s.last)
