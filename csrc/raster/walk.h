/* The two walkers, written once and compiled for 64-bit and 128-bit integers: alone.c includes this file twice.  (No
 * guard, therefore.)
 * In: a set-up triangle.  Out: the covered span of each row.  TL_INT is the integer, TL_WALK(name) names its copy.
 *
 * Both walk E' = (2E + bias) >> (bits + 1), bias -1 on edges that are neither top nor left.  2E changes by multiples of
 * 2^(bits+1) from sample to sample, so the floor keeps its sign at every sample, and E' changes by exactly -dy a column
 * and dx a row.  Squares are tested at one corner an edge: the square meets the triangle only where the corner that
 * lies farthest inside does not lie on the edge or outside, and is held by it only where the one farthest outside
 * does.  No more is needed: with the box, these are all the axes that can separate the two. */
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "raster/setup.c"
#include "raster/sink.c"

#ifndef TL_WALK /* read by itself, as an editor does */
#define TL_INT int64_t
#define TL_UINT uint64_t
#define TL_WALK(name) name##_64
#endif

typedef struct {
    TL_INT value[3]; /* E' at the first sample of the box, >= 0 inside */
    TL_INT dx[3], dy[3];
} TL_WALK(edges);

static inline TL_WALK(edges) TL_WALK(setup_edges)(const tl_triangle *t, const tl_window *window)
{
    TL_WALK(edges) e;
    const int bits = window->subpixel_bits;
    const TL_INT px = ((TL_INT)(t->col0 + window->x_px) * 2 + 1) * ((TL_INT)1 << bits);
    const TL_INT py = ((TL_INT)(t->row0 + window->y_px) * 2 + 1) * ((TL_INT)1 << bits);
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        const TL_INT dx = (TL_INT)t->x_fx[next] - t->x_fx[k], dy = (TL_INT)t->y_fx[next] - t->y_fx[k];
        e.dx[k] = dx;
        e.dy[k] = dy;
        if (window->test != TL_TEST_SAMPLE) { /* no farther than a pixel outside the extent: |E| < 2^63 or 2^127 */
            const int is_outer = window->test == TL_TEST_OUTER;
            const TL_INT x = ((TL_INT)(t->col0 + window->x_px) + (is_outer == (dy < 0))) * ((TL_INT)1 << bits);
            const TL_INT y = ((TL_INT)(t->row0 + window->y_px) + (is_outer == (dx > 0))) * ((TL_INT)1 << bits);
            const TL_UINT corner = (TL_UINT)dx * (TL_UINT)(y - t->y_fx[k]) - (TL_UINT)dy * (TL_UINT)(x - t->x_fx[k]);
            e.value[k] = ((TL_INT)corner - is_outer) >> bits;
            continue;
        }
        const int top_left = dy < 0 || (dy == 0 && dx > 0);
        const TL_UINT doubled =
            (TL_UINT)dx * (TL_UINT)(py - (TL_INT)t->y_fx[k] * 2) - (TL_UINT)dy * (TL_UINT)(px - (TL_INT)t->x_fx[k] * 2);
        e.value[k] = ((TL_INT)doubled - !top_left) >> (bits + 1);
    }
    return e;
}

/* Edge functions stepped by additions, one test a sample.  Based on: J. Pineda, A Parallel Algorithm for Polygon
 * Rasterization, 1988. */
TL_INLINE void TL_WALK(walk_edge)(const tl_triangle *t, const tl_window *window, const tl_target *target, tl_sink sink)
{
    const TL_WALK(edges) e = TL_WALK(setup_edges)(t, window);
    TL_INT row0 = e.value[0], row1 = e.value[1], row2 = e.value[2];
    for (int64_t row = t->row0; row < t->row1; row++) {
        TL_INT e0 = row0, e1 = row1, e2 = row2;
        int64_t col = t->col0;
        while (col < t->col1 && (e0 | e1 | e2) < 0)
            e0 -= e.dy[0], e1 -= e.dy[1], e2 -= e.dy[2], col++;
        const int64_t first = col;
        while (col < t->col1 && (e0 | e1 | e2) >= 0)
            e0 -= e.dy[0], e1 -= e.dy[1], e2 -= e.dy[2], col++;
        if (first < col)
            put_span(t, window, target, sink, row, first, col);
        row0 += e.dx[0], row1 += e.dx[1], row2 += e.dx[2];
    }
}

/* Row ends by a digital differential analyser: E'(col) = value - dy * col >= 0 ends at floor(value / |dy|); one floor
 * division an edge, then quotient and remainder are stepped from row to row.  Horizontal edges say nothing that the box
 * does not.  Based on: J. E. Bresenham, Algorithm for computer control of a digital plotter, 1965. */
TL_INLINE void TL_WALK(walk_scanline)(const tl_triangle *t, const tl_window *window, const tl_target *target,
                                      tl_sink sink)
{
    const TL_WALK(edges) e = TL_WALK(setup_edges)(t, window);
    TL_INT quotient[3], remainder[3], divisor[3], quotient_step[3], remainder_step[3];
    int is_left[3], n = 0;
    for (int k = 0; k < 3; k++) {
        if (e.dy[k] == 0)
            continue;
        divisor[n] = e.dy[k] < 0 ? -e.dy[k] : e.dy[k];
        is_left[n] = e.dy[k] < 0;
        TL_WALK(floor_divide)(e.value[k], divisor[n], quotient + n, remainder + n);
        TL_WALK(floor_divide)(e.dx[k], divisor[n], quotient_step + n, remainder_step + n);
        n++;
    }
    const int64_t width = t->col1 - t->col0;
    for (int64_t row = t->row0; row < t->row1; row++) {
        TL_INT first = 0, end = width;
        for (int k = 0; k < n; k++) {
            if (is_left[k])
                first = -quotient[k] > first ? -quotient[k] : first;
            else
                end = quotient[k] + 1 < end ? quotient[k] + 1 : end;
            quotient[k] += quotient_step[k];
            remainder[k] += remainder_step[k];
            const int carry = remainder[k] >= divisor[k];
            quotient[k] += carry;
            remainder[k] -= carry ? divisor[k] : 0;
        }
        if (first < end)
            put_span(t, window, target, sink, row, t->col0 + (int64_t)first, t->col0 + (int64_t)end);
    }
}

#undef TL_INT
#undef TL_UINT
#undef TL_WALK
