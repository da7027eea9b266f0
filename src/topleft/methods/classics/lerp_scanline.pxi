# Lerp scanline: sorted by height, two float interpolations a row, and the pixels between them.
#
# In: vertices, truncated to pixels.  The long edge runs from the top vertex to the bottom one, the short edges from the top
# to the middle and from the middle to the bottom; either is asked for its x by a float32 fraction of the height, truncated.
# Out: spans that include both ends, without the last row.  "plus-one" is the form that the same lesson starts from: one
# more in the heights of the short edges, against division by zero, and two loops that both draw the middle row.
#
# Based on: D. Sokolov, tinyrenderer, lesson 2: Triangle rasterization and back face culling, 2015.

FORMS["lerp_scanline"] = ("", "plus-one")
cdef enum:
    PLUS_ONE = 1


cdef inline int64_t lerp(int64_t a, int64_t b, int64_t i, int64_t height) noexcept nogil:
    return a + <int64_t>(<float>(b - a) * (<float>i / <float>height))


cdef inline void fill_between(target *t, int64_t y, int64_t x, int64_t other) noexcept nogil:
    fill_span(t, y, min(x, other), max(x, other))


cdef void fill_lerp_scanline(
    target *t, const double *a, const double *b, const double *c, int form, int subpixel_bits
) noexcept nogil:
    cdef int64_t x0 = <int64_t>a[0], y0 = <int64_t>a[1], x1 = <int64_t>b[0], y1 = <int64_t>b[1]
    cdef int64_t x2 = <int64_t>c[0], y2 = <int64_t>c[1]
    cdef int64_t y
    if y0 > y1:
        x0, y0, x1, y1 = x1, y1, x0, y0
    if y0 > y2:
        x0, y0, x2, y2 = x2, y2, x0, y0
    if y1 > y2:
        x1, y1, x2, y2 = x2, y2, x1, y1
    if y0 == y2:  # horizontal, or a point: the height divides
        return
    if form == PLUS_ONE:
        for y in range(max(y0, t.y0), min(y1 + 1, t.y1)):
            fill_between(t, y, lerp(x0, x2, y - y0, y2 - y0), lerp(x0, x1, y - y0, y1 - y0 + 1))
        for y in range(max(y1, t.y0), min(y2 + 1, t.y1)):
            fill_between(t, y, lerp(x0, x2, y - y0, y2 - y0), lerp(x1, x2, y - y1, y2 - y1 + 1))
    else:
        for y in range(max(y0, t.y0), min(y2, t.y1)):
            if y > y1 or y1 == y0:
                fill_between(t, y, lerp(x0, x2, y - y0, y2 - y0), lerp(x1, x2, y - y1, y2 - y1))
            else:
                fill_between(t, y, lerp(x0, x2, y - y0, y2 - y0), lerp(x0, x1, y - y0, y1 - y0))
