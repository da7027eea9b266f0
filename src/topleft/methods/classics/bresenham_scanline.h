/* Bresenham scanline: two Bresenham lines, walked from the top down together, and the pixels between them.
 *
 * In: vertices, truncated to pixels.  They are sorted by y, then x, and turned clockwise; a triangle with a corner at mid
 * height is split there, by linear interpolation, into a flat-bottom and a flat-top triangle.  Out: each row from the left
 * line's outermost pixel to the right line's, both included.  "top-left" fills from the first pixel of either line's run in
 * a row, without the right end and without the last row.  "wireframe" draws only the lines and the flat sides.
 *
 * Based on: xterminal86, Software 3D renderer tutorial, part 2: Triangle, 2023;
 * J. E. Bresenham, Algorithm for computer control of a digital plotter, 1965. */
#ifndef CLASSIC_BRESENHAM_SCANLINE_H
#define CLASSIC_BRESENHAM_SCANLINE_H

#include "target.h"

enum { BRESENHAM_SCANLINE = 0, BRESENHAM_SCANLINE_TOP_LEFT = 1, BRESENHAM_SCANLINE_WIREFRAME = 2 };

typedef struct { /* a generator: (x, y) is the pixel to be handed out next */
    int64_t x, y, n_left;
    int64_t x_step;              /* -1 or 1 */
    int64_t major, minor, error; /* error = 2 * minor - major at the start */
    int is_gentle;               /* more columns than rows */
} classic_line;

/* Starts at the upper end; a horizontal line keeps its direction. */
static inline classic_line start_line(classic_point a, classic_point b)
{
    if (a.y > b.y)
        swap_points(&a, &b);
    const int64_t dx = b.x > a.x ? b.x - a.x : a.x - b.x, dy = b.y - a.y;
    const int64_t major = larger(dx, dy), minor = smaller(dx, dy);
    return (classic_line){.x = a.x,
                          .y = a.y,
                          .n_left = major + 1,
                          .x_step = b.x > a.x ? 1 : -1,
                          .major = major,
                          .minor = minor,
                          .error = 2 * minor - major,
                          .is_gentle = dy < dx};
}

static inline void step_line(classic_line *l)
{
    const int both = l->error >= 0;
    l->n_left--;
    l->error += 2 * l->minor - (both ? 2 * l->major : 0);
    if (l->is_gentle || both)
        l->x += l->x_step;
    if (!l->is_gentle || both)
        l->y++;
}

/* Takes the pixels of row y; leaves first and last as they were when there is none. */
static inline void take_run(const classic_target *t, classic_line *l, int64_t y, int64_t *first, int64_t *last,
                            int is_right)
{
    (void)t, (void)is_right;
    if (l->n_left && l->y == y)
        *first = l->x;
    while (l->n_left && l->y == y) {
        CLASSIC_STEP(t, is_right ? CLASSIC_RIGHT_LINE : CLASSIC_LEFT_LINE, l->x, y, l->x, 0, l->error);
        *last = l->x;
        step_line(l);
    }
}

static void draw_line(const classic_target *t, classic_point a, classic_point b, int is_right)
{
    classic_line l = start_line(a, b);
    (void)is_right;
    while (l.n_left && l.y < t->y1) {
        CLASSIC_STEP(t, is_right ? CLASSIC_RIGHT_LINE : CLASSIC_LEFT_LINE, l.x, l.y, l.x, 0, l.error);
        plot(t, l.x, l.y);
        step_line(&l);
    }
}

/* Draws a triangle with a flat side: a, b on top and c below, or a on top and b, c (right, left) below. */
static void fill_basic(const classic_target *t, classic_point a, classic_point b, classic_point c, int is_flat_top,
                       int form)
{
    const classic_point right_top = is_flat_top ? b : a, right_end = is_flat_top ? c : b;
    if (form == BRESENHAM_SCANLINE_WIREFRAME) {
        draw_line(t, a, c, 0);
        draw_line(t, right_top, right_end, 1);
        fill_span(t, is_flat_top ? a.y : c.y, is_flat_top ? a.x : c.x, b.x);
        return;
    }
    const int left_takes_last = c.x <= a.x, right_takes_first = right_end.x <= right_top.x;
    classic_line left = start_line(a, c), right = start_line(right_top, right_end);
    int64_t left_first = left.x, left_last = left.x, right_first = right.x, right_last = right.x;
    const int64_t y_end = form == BRESENHAM_SCANLINE_TOP_LEFT ? c.y : c.y + 1;
    for (int64_t y = a.y; y < smaller(t->y1, y_end); y++) {
        take_run(t, &left, y, &left_first, &left_last, 0);
        take_run(t, &right, y, &right_first, &right_last, 1);
        CLASSIC_STEP(t, CLASSIC_ROW_LINES, left_first, y, left_first, 0, left_first, left_last, right_first,
                     right_last);
        if (form == BRESENHAM_SCANLINE_TOP_LEFT)
            fill_span(t, y, left_first, right_first - 1);
        else /* which end of a run lies outside depends on the side and on the direction of the line */
            fill_span(t, y, left_takes_last ? left_last : left_first, right_takes_first ? right_first : right_last);
    }
}

/* Sorts by y, then x. */
static inline void sort_points(classic_point *a, classic_point *b)
{
    if (a->y > b->y || (a->y == b->y && a->x > b->x))
        swap_points(a, b);
}

/* Where the side from `top` to `end` is at the height of `middle`. */
static inline classic_point split_side(classic_point top, classic_point end, classic_point middle)
{
    const double share = (double)(middle.y - top.y) / (double)(end.y - top.y);
    return (classic_point){(int64_t)((double)top.x + (double)(end.x - top.x) * share), middle.y};
}

static void fill_bresenham_scanline(const classic_target *t, const double *va, const double *vb, const double *vc,
                                    int form, int subpixel_bits)
{
    classic_point a = truncated(va), b = truncated(vb), c = truncated(vc);
    const int64_t short_by = form == BRESENHAM_SCANLINE_TOP_LEFT;
    (void)subpixel_bits;
    sort_points(&a, &b);
    sort_points(&b, &c);
    sort_points(&a, &b);
    CLASSIC_STEP(t, CLASSIC_SET_UP, a.x, a.y, a.x, 0, a.x, a.y, b.x, b.y, c.x, c.y);
    if (a.y == c.y) { /* a point or a horizontal line */
        fill_span(t, a.y, a.x, c.x - short_by);
        return;
    }
    if (a.x == b.x && b.x == c.x) {
        for (int64_t y = larger(a.y, t->y0); y < smaller(c.y + 1 - short_by, t->y1); y++)
            plot(t, a.x, y);
        return;
    }
    if ((b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x) <= 0)
        swap_points(&b, &c); /* now clockwise as seen */
    if (a.y == b.y)
        fill_basic(t, a, b, c, 1, form);
    else if (b.y == c.y)
        fill_basic(t, a, b, c, 0, form);
    else if (b.y > c.y) { /* major right: the long side from a to b */
        const classic_point split = split_side(a, b, c);
        fill_basic(t, a, split, c, 0, form);
        fill_basic(t, c, split, b, 1, form);
    } else { /* major left: the long side from a to c */
        const classic_point split = split_side(a, c, b);
        fill_basic(t, a, b, split, 0, form);
        fill_basic(t, split, b, c, 1, form);
    }
}

#endif
