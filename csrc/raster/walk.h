/* The two walkers, written once and compiled for 64-bit and 128-bit integers: single_fixed.c includes this file twice,
 * so it has no guard.
 * In: a set-up triangle.  Out: the covered span of each row.  TL_INT is the integer, TL_OP(name) its operation in
 * base/integers.h, TL_WALK(name) the name of its copy.
 *
 * Both walk E' = (2E + bias) >> (bits + 1), bias -1 on edges that are neither top nor left.  2E changes by multiples of
 * 2^(bits+1) from sample to sample, so the floor keeps its sign at every sample, and E' changes by exactly -dy a column
 * and dx a row.  Squares are tested at one corner an edge: the square meets the triangle only where its corner farthest
 * inside the edge is strictly inside, and the triangle holds it only where its corner farthest outside is inside.  That
 * suffices: with the box, these are all the axes that can separate the two. */
#include <stdint.h>

#include "topleft.h"
#include "base/integers.h"
#include "lanes/lanes.h"
#include "vertex/setup.c"
#include "sink/sink.c"

#ifndef TL_WALK /* for editors, which read this file alone */
#define TL_INT int64_t
#define TL_OP(name) i64_##name
#define TL_WALK(name) name##_64
#endif

typedef struct {
    TL_INT value[3]; /* E' at the first sample of the box, >= 0 inside */
    TL_INT dx[3], dy[3];
} TL_WALK(edges);

/* The edge function of an edge with direction (dx, dy), at a point (x, y) from its start. */
static inline TL_INT TL_WALK(edge_at)(TL_INT x, TL_INT y, int64_t dx, int64_t dy)
{
    return TL_OP(wrapping_sub)(TL_OP(wrapping_times)(y, dx), TL_OP(wrapping_times)(x, dy));
}

static inline TL_WALK(edges) TL_WALK(setup_edges)(const tl_triangle *t, const tl_window *window)
{
    TL_WALK(edges) e;
    const int bits = window->subpixel_bits;
    const int64_t col = t->col0 + window->x_px, row = t->row0 + window->y_px;
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        const int64_t dx = t->x_fx[next] - t->x_fx[k], dy = t->y_fx[next] - t->y_fx[k];
        e.dx[k] = TL_OP(from)(dx);
        e.dy[k] = TL_OP(from)(dy);
        if (window->test != TL_TEST_SAMPLE) { /* no farther than a pixel outside the extent: |E| < 2^63 or 2^127 */
            const int is_outer = window->test == TL_TEST_OUTER;
            const TL_INT x = TL_OP(shift_left)(TL_OP(from)(col + (is_outer == (dy < 0))), bits);
            const TL_INT y = TL_OP(shift_left)(TL_OP(from)(row + (is_outer == (dx > 0))), bits);
            const TL_INT corner = TL_WALK(edge_at)(TL_OP(sub)(x, TL_OP(from)(t->x_fx[k])),
                                                   TL_OP(sub)(y, TL_OP(from)(t->y_fx[k])), dx, dy);
            e.value[k] = TL_OP(shift_right)(TL_OP(sub)(corner, TL_OP(from)(is_outer)), bits);
            continue;
        }
        const int top_left = dy < 0 || (dy == 0 && dx > 0);
        const TL_INT doubled = TL_WALK(edge_at)(TL_WALK(center_from)(col, bits, t->x_fx[k]),
                                                TL_WALK(center_from)(row, bits, t->y_fx[k]), dx, dy);
        e.value[k] = TL_OP(shift_right)(TL_OP(sub)(doubled, TL_OP(from)(!top_left)), bits + 1);
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
        while (col < t->col1 && TL_OP(is_negative)(TL_OP(or)(TL_OP(or)(e0, e1), e2))) {
            e0 = TL_OP(sub)(e0, e.dy[0]), e1 = TL_OP(sub)(e1, e.dy[1]), e2 = TL_OP(sub)(e2, e.dy[2]);
            col++;
        }
        const int64_t first = col;
        while (col < t->col1 && !TL_OP(is_negative)(TL_OP(or)(TL_OP(or)(e0, e1), e2))) {
            e0 = TL_OP(sub)(e0, e.dy[0]), e1 = TL_OP(sub)(e1, e.dy[1]), e2 = TL_OP(sub)(e2, e.dy[2]);
            col++;
        }
        if (first < col)
            put_span(t, window, target, sink, row, first, col);
        row0 = TL_OP(add)(row0, e.dx[0]), row1 = TL_OP(add)(row1, e.dx[1]), row2 = TL_OP(add)(row2, e.dx[2]);
    }
}

/* Row ends by a digital differential analyser: E'(col) = value - dy * col >= 0 ends at floor(value / |dy|); one floor
 * division an edge, then quotient and remainder are stepped from row to row.  The box replaces horizontal edges.
 * Based on: J. E. Bresenham, Algorithm for computer control of a digital plotter, 1965. */
TL_INLINE void TL_WALK(walk_scanline)(const tl_triangle *t, const tl_window *window, const tl_target *target,
                                      tl_sink sink)
{
    const TL_WALK(edges) e = TL_WALK(setup_edges)(t, window);
    const TL_INT zero = TL_OP(from)(0), one = TL_OP(from)(1);
    TL_INT quotient[3], remainder[3], divisor[3], quotient_step[3], remainder_step[3];
    int is_left[3], n = 0;
    for (int k = 0; k < 3; k++) {
        if (TL_OP(is_zero)(e.dy[k]))
            continue;
        is_left[n] = TL_OP(is_negative)(e.dy[k]);
        divisor[n] = is_left[n] ? TL_OP(neg)(e.dy[k]) : e.dy[k];
        TL_OP(floor_divide)(e.value[k], divisor[n], quotient + n, remainder + n);
        TL_OP(floor_divide)(e.dx[k], divisor[n], quotient_step + n, remainder_step + n);
        n++;
    }
    for (int64_t row = t->row0; row < t->row1; row++) {
        TL_INT first = zero, end = TL_OP(from)(t->col1 - t->col0);
        for (int k = 0; k < n; k++) {
            if (is_left[k])
                first = TL_OP(max)(first, TL_OP(neg)(quotient[k]));
            else
                end = TL_OP(min)(end, TL_OP(add)(quotient[k], one));
            quotient[k] = TL_OP(add)(quotient[k], quotient_step[k]);
            remainder[k] = TL_OP(add)(remainder[k], remainder_step[k]);
            const int carry = !TL_OP(less)(remainder[k], divisor[k]);
            quotient[k] = TL_OP(add)(quotient[k], TL_OP(from)(carry));
            remainder[k] = TL_OP(sub)(remainder[k], carry ? divisor[k] : zero);
        }
        if (TL_OP(less)(first, end))
            put_span(t, window, target, sink, row, t->col0 + TL_OP(low)(first), t->col0 + TL_OP(low)(end));
    }
}

#undef TL_INT
#undef TL_OP
#undef TL_WALK
