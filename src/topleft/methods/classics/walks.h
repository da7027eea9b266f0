/* The two production walkers, a sample or a row at a time: csrc/raster/walk.h with its steps, for reading.
 *
 * In: vertices in pixels, |x| < 2^60 sub-pixels.  Out: spans.  Both walk E' = (2E + bias) >> (bits + 1), bias -1 on edges that
 * are neither top nor left: the floor keeps its sign at every sample, and E' changes by -dy a column and dx a row.
 *
 * Based on: J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988 (edge);
 * J. E. Bresenham, Algorithm for computer control of a digital plotter, 1965 (scanline). */
#ifndef CLASSIC_WALKS_H
#define CLASSIC_WALKS_H

#include "edges.h"

enum { WALK_EDGE = 0, WALK_SCANLINE = 1 };

typedef struct {
    int64_t x_first, x_end, y_first, y_end; /* half-open */
    tl_int128 value[3];                     /* E' at the first sample, >= 0 inside */
    int64_t dx[3], dy[3];
} classic_walk;

/* The signed area of two sides, doubled: |x|, |y| < 2^62. */
static inline tl_int128 cross_of_sides(int64_t ax, int64_t ay, int64_t bx, int64_t by)
{
    return i128_sub(i128_product(ax, by), i128_product(ay, bx));
}

/* The columns or rows with centres between the lowest and the highest of three numbers. */
static inline void find_centers(const int64_t *at, int bits, int64_t first, int64_t end, int64_t *range)
{
    const int64_t before_center = larger(0, ((int64_t)1 << bits) / 2 - 1);
    range[0] = larger(first, (smaller(smaller(at[0], at[1]), at[2]) + before_center) >> bits);
    range[1] = smaller(end, (larger(larger(at[0], at[1]), at[2]) + before_center) >> bits);
}

/* Returns 0 where no sample is covered. */
static inline int set_up_walk(classic_walk *w, const classic_target *t, int64_t *x, int64_t *y, int bits)
{
    const tl_int128 area = cross_of_sides(x[1] - x[0], y[1] - y[0], x[2] - x[0], y[2] - y[0]);
    if (i128_is_negative(area)) {
        const int64_t kept_x = x[1], kept_y = y[1];
        x[1] = x[2], y[1] = y[2], x[2] = kept_x, y[2] = kept_y;
    }
    find_centers(x, bits, t->x0, t->x1, &w->x_first);
    find_centers(y, bits, t->y0, t->y1, &w->y_first);
    if (i128_is_zero(area) || w->x_first >= w->x_end || w->y_first >= w->y_end)
        return 0;
    for (int k = 0; k < 3; k++) {
        const int next = (k + 1) % 3;
        const int64_t dx = w->dx[k] = x[next] - x[k], dy = w->dy[k] = y[next] - y[k];
        const int64_t px = ((2 * w->x_first + 1) << bits) - 2 * x[k], py = ((2 * w->y_first + 1) << bits) - 2 * y[k];
        const tl_int128 doubled = i128_sub(cross_of_sides(dx, dy, px, py), i128_from(!is_top_left(dx, dy)));
        w->value[k] = i128_shift_right(doubled, bits + 1);
    }
    CLASSIC_STEP(t, CLASSIC_SET_UP_WALK, w->x_first, w->y_first, 0, 0, x[0], y[0], x[1], y[1], x[2], y[2], w->x_first,
                 w->x_end, w->y_first, w->y_end, w->dx[0], w->dx[1], w->dx[2], w->dy[0], w->dy[1], w->dy[2],
                 is_top_left(w->dx[0], w->dy[0]), is_top_left(w->dx[1], w->dy[1]), is_top_left(w->dx[2], w->dy[2]));
    return 1;
}

/* Edge functions that are stepped by additions, one test a sample; a row of a triangle is one run. */
static void walk_edge(const classic_target *t, classic_walk *w)
{
    for (int64_t y = w->y_first; y < w->y_end; y++) {
        tl_int128 e[3] = {w->value[0], w->value[1], w->value[2]};
        int64_t x = w->x_first, first = w->x_end;
        for (; x < w->x_end; x++) {
            const int is_inside = !i128_is_negative(i128_or(i128_or(e[0], e[1]), e[2]));
            CLASSIC_WIDE_STEP(t, CLASSIC_TEST_WALK, x, y, x, 0, i128_from(is_inside), e[0], e[1], e[2]);
            if (is_inside)
                first = smaller(first, x);
            else if (first < x)
                break;
            for (int k = 0; k < 3; k++)
                e[k] = i128_sub(e[k], i128_from(w->dy[k]));
        }
        if (first < x)
            fill_span(t, y, first, x - 1);
        for (int k = 0; k < 3; k++)
            w->value[k] = i128_add(w->value[k], i128_from(w->dx[k]));
    }
}

typedef struct { /* where an edge that is not horizontal crosses the row, and its step */
    int is_left;
    tl_int128 quotient, rest, quotient_step, rest_step, divisor;
} classic_crossing;

static inline void step_crossing(classic_crossing *c)
{
    c->quotient = i128_add(c->quotient, c->quotient_step), c->rest = i128_add(c->rest, c->rest_step);
    if (!i128_less(c->rest, c->divisor)) /* both remainders are below the divisor */
        c->quotient = i128_add(c->quotient, i128_from(1)), c->rest = i128_sub(c->rest, c->divisor);
}

/* Row ends: one floor division an edge, then quotient and remainder are stepped from row to row. */
static void walk_scanline(const classic_target *t, classic_walk *w)
{
    classic_crossing edges[3];
    int n = 0, level = -1; /* the edge that is horizontal */
    for (int k = 0; k < 3; k++) {
        const int64_t dy = w->dy[k];
        classic_crossing *c = edges + n;
        if (!dy) {
            level = k;
            continue;
        }
        c->is_left = dy < 0, c->divisor = i128_from(dy < 0 ? -dy : dy), n++;
        i128_floor_divide(w->value[k], c->divisor, &c->quotient, &c->rest);
        i128_floor_divide(i128_from(w->dx[k]), c->divisor, &c->quotient_step, &c->rest_step);
    }
    for (int64_t y = w->y_first; y < w->y_end; y++) {
        tl_int128 first = i128_from(0), end = i128_from(w->x_end - w->x_first), told[6] = {0};
        for (int i = 0; i < n; i++) {
            const classic_crossing *c = edges + i;
            if (c->is_left)
                first = i128_max(first, i128_neg(c->quotient));
            else
                end = i128_min(end, i128_add(c->quotient, i128_from(1)));
            told[2 * i] = c->quotient, told[2 * i + 1] = c->rest;
        }
        const tl_int128 x_first = i128_add(first, i128_from(w->x_first)), x_end = i128_add(end, i128_from(w->x_first));
        CLASSIC_WIDE_STEP(t, CLASSIC_ROW_ENDS + 1 + level, i128_low(x_first), y, 0, 0, x_first, x_end, told[0], told[1],
                          told[2], told[3], told[4], told[5]);
        if (i128_less(first, end))
            fill_span(t, y, i128_low(x_first), i128_low(x_end) - 1);
        for (int i = 0; i < n; i++)
            step_crossing(edges + i);
    }
}

static void fill_walk(const classic_target *t, const double *a, const double *b, const double *c, int form, int bits)
{
    const double scale = (double)(1 << bits);
    int64_t x[3] = {(int64_t)rint(a[0] * scale), (int64_t)rint(b[0] * scale), (int64_t)rint(c[0] * scale)};
    int64_t y[3] = {(int64_t)rint(a[1] * scale), (int64_t)rint(b[1] * scale), (int64_t)rint(c[1] * scale)};
    classic_walk w;
    if (!set_up_walk(&w, t, x, y, bits))
        return;
    if (form == WALK_EDGE)
        walk_edge(t, &w);
    else
        walk_scanline(t, &w);
}

#endif
