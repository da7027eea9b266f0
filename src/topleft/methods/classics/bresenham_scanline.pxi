# Bresenham scanline: two Bresenham lines, walked from the top down together, and the pixels between them.
#
# In: vertices, truncated to pixels.  They are sorted by y, then x, and turned clockwise; a triangle with a corner at mid
# height is split there, by linear interpolation, into one with a flat bottom and one with a flat top.  Out: each row from
# the left line's outermost pixel to the right one's, both included.  "top-left" takes the first pixel of either line's run
# in a row and leaves the right one and the last row out.  "wireframe" draws the lines and the flat sides alone.
#
# Based on: xterminal86, Software 3D renderer tutorial, part 2: Triangle, 2023;
# J. E. Bresenham, Algorithm for computer control of a digital plotter, 1965.

FORMS["bresenham_scanline"] = ("", "top-left", "wireframe")
cdef enum:
    OVERDRAW = 0
    WITHOUT_ENDS = 1
    WIREFRAME = 2

cdef struct point:
    int64_t x, y

cdef struct line:  # a generator: (x, y) is the pixel to be handed out next
    int64_t x, y, n_left
    int64_t x_step  # -1 or 1
    int64_t major, minor, error  # error = 2 * minor - major at the start
    bint is_gentle  # more columns than rows


cdef inline void start_line(line *l, point a, point b) noexcept nogil:
    """Start at the upper end; a horizontal line keeps its direction."""
    if a.y > b.y:
        a, b = b, a
    cdef int64_t dx = b.x - a.x if b.x > a.x else a.x - b.x, dy = b.y - a.y
    l.x, l.y, l.x_step = a.x, a.y, 1 if b.x > a.x else -1
    l.is_gentle = dy < dx
    l.major, l.minor = max(dx, dy), min(dx, dy)
    l.error, l.n_left = 2 * l.minor - l.major, l.major + 1


cdef inline void step_line(line *l) noexcept nogil:
    cdef bint both = l.error >= 0
    l.n_left -= 1
    l.error += 2 * l.minor - (2 * l.major if both else 0)
    if l.is_gentle or both:
        l.x += l.x_step
    if not l.is_gentle or both:
        l.y += 1


cdef inline void take_run(line *l, int64_t y, int64_t *first, int64_t *last) noexcept nogil:
    """Take the pixels of row y; first and last stay what they were when there is none."""
    if l.n_left and l.y == y:
        first[0] = l.x
    while l.n_left and l.y == y:
        last[0] = l.x
        step_line(l)


cdef void draw_line(target *t, point a, point b) noexcept nogil:
    cdef line l
    start_line(&l, a, b)
    while l.n_left and l.y < t.y1:
        plot(t, l.x, l.y)
        step_line(&l)


cdef void fill_basic(target *t, point a, point b, point c, bint is_flat_top, int form) noexcept nogil:
    """Draw a triangle with a flat side: a, b on top and c below, or a on top and b, c (right, left) below."""
    cdef line left, right
    cdef int64_t y, y_end = c.y, left_first, left_last, right_first, right_last
    cdef bint left_takes_last = c.x <= a.x, right_takes_first = (c.x <= b.x) if is_flat_top else (b.x <= a.x)
    if form == WIREFRAME:
        draw_line(t, a, c)
        draw_line(t, b if is_flat_top else a, c if is_flat_top else b)
        fill_span(t, a.y if is_flat_top else c.y, a.x if is_flat_top else c.x, b.x)
        return
    start_line(&left, a, c)
    start_line(&right, b if is_flat_top else a, c if is_flat_top else b)
    left_first = left_last = left.x
    right_first = right_last = right.x
    for y in range(a.y, min(t.y1, y_end if form == WITHOUT_ENDS else y_end + 1)):
        take_run(&left, y, &left_first, &left_last)
        take_run(&right, y, &right_first, &right_last)
        if form == WITHOUT_ENDS:
            fill_span(t, y, left_first, right_first - 1)
        else:
            # Which end of a run lies outside depends on the side and on the way that the line goes.
            fill_span(t, y, left_last if left_takes_last else left_first,
                      right_first if right_takes_first else right_last)


cdef inline bint comes_first(point a, point b) noexcept nogil:
    return a.y < b.y or (a.y == b.y and a.x <= b.x)


cdef void fill_bresenham_scanline(
    target *t, const double *va, const double *vb, const double *vc, int form, int subpixel_bits
) noexcept nogil:
    cdef point a, b, c, split
    cdef int64_t y, short_by = 1 if form == WITHOUT_ENDS else 0
    a.x, a.y, b.x, b.y, c.x, c.y = <int64_t>va[0], <int64_t>va[1], <int64_t>vb[0], <int64_t>vb[1], <int64_t>vc[0], <int64_t>vc[1]
    if not comes_first(a, b):
        a, b = b, a
    if not comes_first(b, c):
        b, c = c, b
    if not comes_first(a, b):
        a, b = b, a
    if a.y == c.y:  # a point or a horizontal line
        fill_span(t, a.y, a.x, c.x - short_by)
    elif a.x == b.x and b.x == c.x:
        for y in range(max(a.y, t.y0), min(c.y + 1 - short_by, t.y1)):
            plot(t, a.x, y)
    else:
        if (b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x) <= 0:
            b, c = c, b  # now clockwise as seen
        if a.y == b.y:
            fill_basic(t, a, b, c, True, form)
        elif b.y == c.y:
            fill_basic(t, a, b, c, False, form)
        elif b.y > c.y:  # major right: the long side from a to b
            split.x = <int64_t>(a.x + (b.x - a.x) * (<double>(c.y - a.y) / <double>(b.y - a.y)))
            split.y = c.y
            fill_basic(t, a, split, c, False, form)
            fill_basic(t, c, split, b, True, form)
        else:  # major left: the long side from a to c
            split.x = <int64_t>(a.x + (c.x - a.x) * (<double>(b.y - a.y) / <double>(c.y - a.y)))
            split.y = b.y
            fill_basic(t, a, b, split, False, form)
            fill_basic(t, split, b, c, True, form)


def line_pixels(int64_t x0, int64_t y0, int64_t x1, int64_t y1):
    """Return the (N, 2) pixels of a line, from its upper end down."""
    cdef line l
    cdef point a, b
    cdef Py_ssize_t i
    cdef Py_buffer view
    cdef int64_t *pixels
    a.x, a.y, b.x, b.y = x0, y0, x1, y1
    start_line(&l, a, b)
    made = np.empty((l.n_left, 2), np.int64)
    pixels = <int64_t *>lend(made, &view, sizeof(int64_t), 2, PyBUF_WRITABLE)
    for i in range(view.shape[0]):
        pixels[2 * i], pixels[2 * i + 1] = l.x, l.y
        step_line(&l)
    PyBuffer_Release(&view)
    return made
