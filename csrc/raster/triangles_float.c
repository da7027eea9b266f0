/* Float: TL_LANES triangles at a time without snapped vertices, as edge functions in float32 with a band of
 * doubt.
 * In: points in pixels and triangles.  Out: boxes, edge functions, depth planes; which lanes lie on a grid.
 *
 * A sample belongs to a triangle by the sign of the exact edge functions of the float64 numbers in the array, with the
 * top-left rule where an edge function is 0.  Boxes are exact: the samples in the extent.  centre - x is exact from
 * column 0 on; left of it the rounded column may be one too low, and is compared.
 *
 * Points are measured in float64 from the first sample of the box.  Extents are at most TL_MAX_BOX_PX.  u = 2^-24;
 * X = max(width, 1), Y = max(height, 1) of the extent.  The first sample lies in the extent, so every |x - cx| <= X,
 * and any E in the box is at most XY.
 *
 * 1. Rows: edge functions are set up in float64 and rounded once to float32.  float64: differences, two products, their
 *    difference: at most 8 * 2^-53 XY = 2^-26 u XY, in the slack below.  Rounding errs by |e0| u, |dx| u,
 *    |dy| u; at row i <= height and column k <= width, E = e0 + i dx - k dy, that adds up to 3 u XY.
 * 2. Boxes of up to 4x4 samples: the distances of the points are rounded to float32, and the rest is float32.  Points
 *    moved by u X and u Y move E = (A - S) x (B - S) by 4 u XY.  The setup rounds dx, dy, two products and their
 *    difference: 5 u XY; i dx and k dy err by 2 u XY; six additions of values up to XY by 6 u XY.  Squares subtract
 *    their corner: 2 u XY; for an edge that float32 takes for level or upright the wrong corner may be taken, where E
 *    differs by 4 u XY at most.  That is 23 u XY: E within 24 u XY of 0 is refined (TL_BOX_BAND).  Twice the
 *    area errs by 13 u XY: three points moved, 6; four differences, two products and their difference, 7.
 *    Places (exact.h) are up to 2^-19 px from points, and are measured without an error: that moves E by
 *    2^-18 (X + Y) <= 128 u XY instead of 4 u XY.  Together 147 u XY: E within 156 u XY is refined
 *    (TL_PLACE_BAND), and twice the area errs by less than twice that.  Boxes are those of the places and a unit around
 *    them; a sample beside the extent lies outside of some edge.
 * 3. Rows: v = e0 + i dx, rounded once or twice, errs by less than 5.01 u XY from E at column 0, the errors of k dy for
 *    any column k included: |v - k d - E| < 5.01 u XY < M = 6 u XY, d = |dy|.  q = v * (1 / d) errs by 2.01 u |q|.
 *    Where |q - k| > M / d + 2.01 u |q| the sign of v - k d is that of E.  So a row end is refined where
 *    |q - nearest integer| <= M / d + 36 u in boxes of up to 17 columns, 130 u in those of up to 62.
 *    Farther out both ends of the comparison are clamped to the box.
 * 4. A band above 1/2, of a nearly level edge, refines every row: |q - nearest integer| <= 1/2.  A level edge is never
 *    refined: the exact box decides.  A difference that only float32 takes for 0 is set to 1e-30.
 *    Squares are tested at corners up to a pixel outside the extent: X and Y are then two pixels more.
 * 5. Vertices on 2^-8 px: ties are systematic, so lanes in doubt are tested, and the band of lanes on the grid is 0.
 *    Boxes of up to 4x4 samples: points are measured without an error, edge functions are multiples of 2^-16, and while
 *    XY <= 64 nothing is rounded in 2., because all its numbers are below 2^7; they are shifted by half a unit, inwards
 *    where ties are outside and else outwards.  Larger boxes: integers of 2^-8 px, as in triangles_fixed.c and rows.c.
 *
 * tests/raster/test_exact.py draws with bands four times narrower, which give wrong pictures. */
#ifndef TL_TRIANGLES_FLOAT_C
#define TL_TRIANGLES_FLOAT_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/corners.h"
#include "vertex/exact.h"
#include "vertex/project.c"
#include "vertex/setup.c"
#include "exact/sign.c"
#include "sink/sink.c"
#include "raster/state.h"

#define TL_BOX_BAND 0x1.8p-20f /* 24 u */
#define TL_ROW_BAND 0x1.8p-22f /* 6 u */
#define TL_PLACE_UNIT 0x1p-18f
#define TL_PLACE_BAND 0x1.38p-17f /* 156 u */
#define TL_GRID_BITS 8
#define TL_GRID_VECTORS 64    /* few vectors of a fine grid have a tie */
#define TL_EXACT_BOX 64.0f    /* pixels */
#define TL_HALF_UNIT 0x1p-17f /* half of the unit of edge functions on the grid */

/* Loads the corners of a triangle, swapped if is_turned. */
TL_INLINE void load_turned(const walk_state *s, int32_t id, int is_turned, exact_point *p)
{
    int32_t corners[3];
    read_corners(s->snapped, id, corners);
    p[0] = point_of(s->points, corners[0]);
    p[1] = point_of(s->points, corners[is_turned ? 2 : 1]);
    p[2] = point_of(s->points, corners[is_turned ? 1 : 2]);
}

/* Loads the corners of TL_LANES triangles. */
TL_INLINE void load_points(const tl_exact_points *points, tl_sink sink, const int32_t *corners, vd *x, vd *y, vd *z)
{
    for (int k = 0; k < 3; k++) {
        if (points->stride == 2) { /* constants: an address without a product */
            vd_load_pairs(points->points, 2, corners + k, &x[k], &y[k]);
            if (sink_has_depth(sink))
                z[k] = vd_set1(0.0);
        } else if (!sink_has_depth(sink)) {
            vd_load_pairs(points->points, points->stride, corners + k, &x[k], &y[k]);
        } else if (points->stride == TL_PLACED) {
            vi x_fx, y_fx;
            vd_load_places(points->points, corners + k, &x[k], &y[k], &z[k], &x_fx, &y_fx);
        } else {
            vd_load_triples(points->points, corners + k, &x[k], &y[k], &z[k]);
        }
    }
}

/* Twice the area; deterministic up to the sign when corners are swapped. */
TL_INLINE vd area_of_points(const vd *x, const vd *y)
{
    const vd x1 = vd_sub(x[1], x[0]), y1 = vd_sub(y[1], y[0]), x2 = vd_sub(x[2], x[0]), y2 = vd_sub(y[2], y[0]);
    return vd_sub(vd_mul(x1, y2), vd_mul(y1, x2));
}

/* Refines the sign of the area of each lane in `doubted`. */
static __attribute__((noinline)) void refine_turns(const walk_state *s, vi all_ids, unsigned doubted,
                                                   unsigned *negative, unsigned *flat)
{
    int32_t ids[TL_MAX_LANES];
    vi_store(ids, all_ids);
    for (; doubted; doubted &= doubted - 1) {
        const int k = __builtin_ctz(doubted);
        exact_point p[3];
        load_turned(s, ids[k], 0, p);
        const int sign = edge_sign(p[0], p[1], p[2]);
        *negative = (*negative & ~(1u << k)) | (unsigned)(sign < 0) << k;
        *flat |= (unsigned)(sign == 0) << k;
    }
}

/* Finds the triangles to be swapped, and removes those without an area: the sign of a float64 area is right beyond
 * 2^-51 of its terms (J. R. Shewchuk), and is refined otherwise.  For vertices on 2^-8 px it is exact. */
TL_INLINE void find_turns(const walk_state *s, lane_exact *t, vm on_grid)
{
    const vd x1 = vd_sub(t->x[1], t->x[0]), y1 = vd_sub(t->y[1], t->y[0]);
    const vd x2 = vd_sub(t->x[2], t->x[0]), y2 = vd_sub(t->y[2], t->y[0]);
    const vd left = vd_mul(x1, y2), right = vd_mul(y1, x2), zero = vd_set1(0.0);
    const vd size = vd_add(vd_abs(left), vd_abs(right));
    const vd bound = vd_max(vd_mul(size, vd_set1(0x1p-51)), vd_set1(1e-280));
    const vd area = vd_sub(left, right);
    const vm positive = vd_ge(area, bound), negative = vd_ge(vd_sub(zero, area), bound);
    const vm not_told = vm_and_not(t->live, vm_or(positive, negative));
    t->live = vm_and_not(t->live, vm_and(not_told, on_grid));
    const unsigned doubted = vm_bits(vm_and_not(not_told, on_grid));
    t->turned = negative;
    if (__builtin_expect(doubted != 0, 0)) {
        unsigned turned = vm_bits(negative), flat = 0;
        refine_turns(s, t->ids, doubted, &turned, &flat);
        t->turned = vm_from_bits(turned);
        t->live = vm_and_not(t->live, vm_from_bits(flat));
    }
    t->to_turn = t->turned;
}

/* Swaps corners 1 and 2 in the lanes of to_turn. */
TL_INLINE void turn_points(lane_exact *t)
{
    const vd x = t->x[1], y = t->y[1];
    t->x[1] = vd_select(t->to_turn, t->x[2], x), t->y[1] = vd_select(t->to_turn, t->y[2], y);
    t->x[2] = vd_select(t->to_turn, x, t->x[2]), t->y[2] = vd_select(t->to_turn, y, t->y[2]);
    t->to_turn = vm_first(0);
}

/* Removes the side that is culled. */
TL_INLINE void cull_turned(const walk_state *s, lane_exact *t)
{
    if (s->snapped->cull == TL_CULL_BACK)
        t->live = vm_and(t->live, t->turned);
    else if (s->snapped->cull == TL_CULL_FRONT)
        t->live = vm_and_not(t->live, t->turned);
}

/* Moves the point at which edge k of TL_LANES triangles is tested, as in `tested_point`. */
TL_INLINE void move_to_corners(const vd *x, const vd *y, int k, tl_test test, vd *px, vd *py)
{
    const int next = k == 2 ? 0 : k + 1;
    const vd zero = vd_set1(0.0), one = vd_set1(1.0);
    if (test == TL_TEST_SAMPLE)
        return;
    const vd inside = test == TL_TEST_OUTER ? one : zero, outside = test == TL_TEST_OUTER ? zero : one;
    *px = vd_add(*px, vd_select(vd_ge(y[k], y[next]), inside, outside)); /* of equal corners either will do */
    *py = vd_add(*py, vd_select(vd_ge(x[next], x[k]), inside, outside));
}

/* Sets edge functions in float32, see the head of this file. */
TL_INLINE void set_float_edges(lane_exact *t)
{
    const vd zero = vd_set1(0.0), least = vd_set1(0x1p-1074);
    const vf least_f = vf_set1(1e-30f);
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        const vd dx = vd_sub(t->x[next], t->x[k]), dy = vd_sub(t->y[next], t->y[k]);
        vd px = t->sample_x, py = t->sample_y;
        move_to_corners(t->x, t->y, k, t->test, &px, &py);
        const vd x = vd_sub(t->x[k], px), y = vd_sub(t->y[k], py);
        t->e[k] = vf_from_vd(vd_sub(vd_mul(dy, x), vd_mul(dx, y)));
        t->dx[k] = vf_from_vd(dx), t->dy[k] = vf_from_vd(dy);
        const vm level = vm_and(vf_lt(t->dy[k], least_f), vf_lt(vf_set1(-1e-30f), t->dy[k]));
        if (__builtin_expect(vm_any(level), 0)) {
            const vm down = vm_and(level, vd_ge(dy, least)), up = vm_and(level, vd_ge(vd_sub(zero, dy), least));
            t->dy[k] =
                vf_select(down, least_f, vf_select(up, vf_set1(-1e-30f), vf_select(level, vf_set1(0.0f), t->dy[k])));
        }
    }
}

/* Sets the points of set_box_edges: relative to the first sample. */
TL_INLINE void measure_points(lane_exact *t)
{
    for (int k = 0; k < 3; k++) {
        t->from_x[k] = vf_from_vd(vd_sub(t->x[k], t->sample_x));
        t->from_y[k] = vf_from_vd(vd_sub(t->y[k], t->sample_y));
    }
    t->band = vf_mul(t->xy, vf_set1(TL_BOX_BAND));
}

/* Sets the points of set_box_edges from places, relative to the first sample. */
TL_INLINE void measure_places(const walk_state *s, const vi *x_fx, const vi *y_fx, vi col, vi row, lane_exact *t)
{
    const vf unit = vf_set1(TL_PLACE_UNIT);
    const vi x = vi_add(vi_shift_left(col, TL_PLACE_BITS), vi_set1(place_of(s->centre_x)));
    const vi y = vi_add(vi_shift_left(row, TL_PLACE_BITS), vi_set1(place_of(s->centre_y)));
    for (int k = 0; k < 3; k++) {
        t->from_x[k] = vf_mul(vf_from_vi(vi_sub(x_fx[k], x)), unit);
        t->from_y[k] = vf_mul(vf_from_vi(vi_sub(y_fx[k], y)), unit);
    }
    t->band = vf_mul(t->xy, vf_set1(TL_PLACE_BAND));
}

/* Sets the edge functions over boxes of up to 4x4 samples, from points in float32, and finds the triangles to be
 * swapped. */
TL_INLINE void set_box_edges(const walk_state *s, lane_exact *t, vm on_grid)
{
    const vf zero = vf_set1(0.0f), one = vf_set1(1.0f);
    const vf band = vf_select(on_grid, zero, vf_add(t->band, t->band));
    const vf inside = t->test == TL_TEST_OUTER ? one : zero, outside = t->test == TL_TEST_OUTER ? zero : one;
    vf x[3] = {t->from_x[0], t->from_x[1], t->from_x[2]}, y[3] = {t->from_y[0], t->from_y[1], t->from_y[2]};
    const vf x1 = vf_sub(x[1], x[0]), y1 = vf_sub(y[1], y[0]), x2 = vf_sub(x[2], x[0]), y2 = vf_sub(y[2], y[0]);
    const vf area = vf_sub(vf_mul(x1, y2), vf_mul(y1, x2));
    t->turned = t->to_turn = vf_lt(area, vf_sub(zero, band));
    const vm not_told = vm_and_not(t->live, vm_or(vf_lt(band, area), t->turned));
    t->live = vm_and_not(t->live, vm_and(not_told, on_grid));
    if (__builtin_expect(vm_any(vm_and_not(not_told, on_grid)), 0))
        find_turns(s, t, on_grid);
    const vf old_x = x[1], old_y = y[1];
    x[1] = vf_select(t->turned, x[2], old_x), y[1] = vf_select(t->turned, y[2], old_y);
    x[2] = vf_select(t->turned, old_x, x[2]), y[2] = vf_select(t->turned, old_y, y[2]);
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        t->dx[k] = vf_sub(x[next], x[k]), t->dy[k] = vf_sub(y[next], y[k]);
    }
    for (int k = 0; k < 3; k++) {
        vf px = x[k], py = y[k];
        if (t->test != TL_TEST_SAMPLE) { /* as in `move_to_corners` */
            px = vf_sub(px, vf_select(vf_lt(zero, t->dy[k]), outside, inside));
            py = vf_sub(py, vf_select(vf_lt(t->dx[k], zero), outside, inside));
        }
        t->e[k] = vf_sub(vf_mul(t->dy[k], px), vf_mul(t->dx[k], py));
    }
}

/* The triangles with all vertices on 2^-8 px; of_boxes: and small enough that `set_box_edges` is exact. */
TL_INLINE vm find_on_grid(const walk_state *s, const lane_exact *t, int of_boxes)
{
    vd off = vd_set1(0.0);
    for (int k = 0; k < 3; k++)
        off = vd_or(off, vd_or(vd_off_256th(t->x[k]), vd_off_256th(t->y[k])));
    const vm good = vd_ge(vd_set1(0.0), vd_abs(off));
    return of_boxes ? vm_and(good, vf_ge(vf_set1(TL_EXACT_BOX * (float)s->points->band), t->xy)) : good;
}

/* Shifts the edge functions of set_box_edges, in lanes of m, by half a unit, outwards where ties are inside and else
 * inwards: then none is 0 at a sample. */
TL_INLINE void set_ties(lane_exact *t, vm m)
{
    const vf zero = vf_set1(0.0f), half = vf_set1(TL_HALF_UNIT), wide = vf_set1(0x1p15f);
    const vf other = t->test == TL_TEST_OUTER ? vf_sub(zero, half) : half;
    for (int k = 0; k < 3; k++) {
        /* left: dy < 0, top: dy = 0 and dx > 0; as one number, |dx| <= 64 and dy a multiple of 2^-8 */
        const vm top_left = vf_lt(vf_fma(t->dy[k], wide, vf_sub(zero, t->dx[k])), zero);
        const vf moved = t->test != TL_TEST_SAMPLE ? other : vf_select(top_left, half, vf_sub(zero, half));
        t->e[k] = vf_select(m, vf_add(t->e[k], moved), t->e[k]);
    }
    t->on_grid = vm_or(t->on_grid, m);
}

/* Sets the edge functions of the lanes in m to those of triangles_fixed.c, half a unit inwards: none is 0 at a
 * sample. */
static __attribute__((noinline)) void set_grid_edges(lane_exact *t, vm m)
{
    vi x[3], y[3]; /* doubled, relative to the first sample */
    const vd unit2 = vd_set1((double)(2 << TL_GRID_BITS));
    for (int k = 0; k < 3; k++) {
        x[k] = vi_round(vd_mul(vd_sub(t->x[k], t->sample_x), unit2));
        y[k] = vi_round(vd_mul(vd_sub(t->y[k], t->sample_y), unit2));
    }
    const vi x1 = x[1], y1 = y[1];
    x[1] = vi_select(t->to_turn, x[2], x1), y[1] = vi_select(t->to_turn, y[2], y1);
    x[2] = vi_select(t->to_turn, x1, x[2]), y[2] = vi_select(t->to_turn, y1, y[2]);
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        const vi dx = vi_shift_right(vi_sub(x[next], x[k]), 1), dy = vi_shift_right(vi_sub(y[next], y[k]), 1);
        const vi doubled = vi_sub(vi_mul(dy, x[k]), vi_mul(dx, y[k])), zero = vi_set1(0), one = vi_set1(1);
        const vm top_left = vi_gt(zero, vi_sub(vi_shift_left(dy, 16), dx));
        vi biased = vi_select(top_left, doubled, vi_sub(doubled, one));
        if (t->test != TL_TEST_SAMPLE) { /* as in `tested_point` */
            const vi inside = t->test == TL_TEST_OUTER ? one : zero, outside = vi_sub(one, inside);
            const vi right = vi_select(vi_gt(zero, dy), inside, outside);
            const vi down = vi_select(vi_gt(dx, zero), inside, outside);
            const vi moved = vi_shift_left(vi_sub(vi_mul(dx, down), vi_mul(dy, right)), TL_GRID_BITS + 1);
            biased = vi_sub(vi_add(doubled, moved), inside);
        }
        const vi e = vi_shift_right(biased, TL_GRID_BITS + 1);
        t->e[k] = vf_select(m, vf_add(vf_from_vi(e), vf_set1(0.5f)), t->e[k]);
        t->dx[k] = vf_select(m, vf_from_vi(dx), t->dx[k]);
        t->dy[k] = vf_select(m, vf_from_vi(dy), t->dy[k]);
    }
    t->on_grid = m;
}

/* Finds triangles in doubt that lie on the grid, and sets their edges exactly; returns their lanes. */
static __attribute__((noinline)) vm try_grid(walk_state *s, lane_exact *t, int of_boxes)
{
    const vm good = vm_and_not(find_on_grid(s, t, of_boxes), t->on_grid);
    if (vm_any(vm_and(good, t->live))) {
        s->may_be_on_grid = TL_GRID_VECTORS;
        if (of_boxes)
            set_ties(t, good);
        else
            set_grid_edges(t, vm_or(good, t->on_grid));
    }
    return good;
}

/* Whether points lie inside edge k of TL_LANES triangles, or outside, beyond the error of float64 (Shewchuk's bound A);
 * where neither is set the exact sign decides. */
typedef struct {
    vm inside, outside;
} lane_sides_of_edge;

TL_INLINE lane_sides_of_edge sides_of_edge(const vd *x, const vd *y, int k, vd px, vd py, tl_test test)
{
    const int next = k == 2 ? 0 : k + 1;
    move_to_corners(x, y, k, test, &px, &py);
    const vd left = vd_mul(vd_sub(x[next], x[k]), vd_sub(py, y[k]));
    const vd right = vd_mul(vd_sub(y[next], y[k]), vd_sub(px, x[k]));
    const vd size = vd_add(vd_abs(left), vd_abs(right)), e = vd_sub(left, right);
    const vd bound = vd_add(vd_mul(size, vd_set1(0x1p-51)), vd_set1(1e-280));
    return (lane_sides_of_edge){vd_ge(e, bound), vd_ge(vd_sub(vd_set1(0.0), e), bound)};
}

/* Points and first samples of TL_LANES triangles, for vd_pick. */
typedef struct {
    double x[3][TL_MAX_LANES], y[3][TL_MAX_LANES], sample_x[TL_MAX_LANES], sample_y[TL_MAX_LANES];
} picked_points;

TL_INLINE void store_points_to_pick(const lane_exact *t, picked_points *m)
{
    for (int k = 0; k < 3; k++)
        vd_store(m->x[k], t->x[k]), vd_store(m->y[k], t->y[k]);
    vd_store(m->sample_x, t->sample_x), vd_store(m->sample_y, t->sample_y);
}

/* The test of the window for masks and counts; a constant for other sinks, which never test squares. */
TL_INLINE tl_test test_of(const walk_state *s, tl_sink sink)
{
    return sink == TL_SINK_MASK || sink == TL_SINK_COUNT ? s->window->test : TL_TEST_SAMPLE;
}

/* The first pixels whose samples are not left of x. */
TL_INLINE vi first_pixels(vd x, vd centre, int is_left_of_0)
{
    const vi n = vi_ceil(vd_sub(x, centre));
    if (!is_left_of_0)
        return n;
    const vm is_low = vm_and_not(vm_all(), vd_ge(vd_add(vd_from_vi(n), centre), x));
    return vi_add(n, vi_select(is_low, vi_set1(1), vi_set1(0)));
}

/* Sets the pixels [*first, *end) whose samples lie in extents, or whose squares meet them in more than a line, or lie
 * in them. */
TL_INLINE void find_pixels_of(vd low, vd high, tl_test test, double centre, int is_left_of_0, vi *first, vi *end)
{
    const vd at = vd_set1(centre);
    if (test == TL_TEST_SAMPLE) {
        *first = first_pixels(low, at, is_left_of_0), *end = first_pixels(high, at, is_left_of_0);
        return;
    }
    *first = test == TL_TEST_OUTER ? vi_round(vd_floor(low)) : vi_ceil(low);
    *end = test == TL_TEST_OUTER ? vi_ceil(high) : vi_round(vd_floor(high));
}

/* The pixels outside the extent of a triangle up to which edges are tested. */
TL_INLINE double border_of(tl_test test) { return test == TL_TEST_SAMPLE ? 0.0 : 2.0; }

/* Sets the boxes of triangles from their points. */
TL_INLINE void find_boxes_of_points(const walk_state *s, tl_sink sink, vm live, lane_batch *b)
{
    const vd *x = b->t.x, *y = b->t.y;
    const vd sum = vd_add(vd_add(vd_add(x[0], x[1]), vd_add(y[0], y[1])), vd_add(x[2], y[2]));
    const vd x_min = vd_min(vd_min(x[0], x[1]), x[2]), x_max = vd_max(vd_max(x[0], x[1]), x[2]);
    const vd y_min = vd_min(vd_min(y[0], y[1]), y[2]), y_max = vd_max(vd_max(y[0], y[1]), y[2]);
    const vd width = vd_sub(x_max, x_min), height = vd_sub(y_max, y_min);
    const tl_test test = test_of(s, sink);
    const vf one = vf_set1(1.0f), border = vf_set1((float)border_of(test));
    const vd widest = vd_set1(s->is_far ? -1.0 : TL_MAX_BOX_PX - border_of(test));
    const vd farthest = vd_max(vd_max(x_max, y_max), vd_sub(vd_set1(0.0), vd_min(x_min, y_min)));
    const vm in_range = vm_and(vd_ge(vd_set1(0x1p30), farthest), vd_ge(vd_set1(0x1p33), sum)); /* false for NaN */
    const vm fits = vm_and(in_range, vd_ge(widest, vd_max(width, height)));
    const int is_left_of_0 = s->limits.left < 0 || s->limits.top < 0;
    vi left, right;
    b->single = vm_and_not(live, fits), b->drawn = vm_and(live, fits);
    find_pixels_of(x_min, x_max, test, s->centre_x, is_left_of_0, &left, &right);
    find_pixels_of(y_min, y_max, test, s->centre_y, is_left_of_0, &b->top, &b->bottom);
    cut_boxes(s, left, right, b);
    b->xy = vf_mul(vf_max(vf_add(vf_from_vd(width), border), one), vf_max(vf_add(vf_from_vd(height), border), one));
}

/* Sets the pixels with samples between places, or up to a unit beside them. */
TL_INLINE void find_pixels_of_places(vi low, vi high, double centre, vi *first, vi *end)
{
    const int32_t at = place_of(centre), unit = 1 << TL_PLACE_BITS;
    *first = vi_shift_right(vi_add(low, vi_set1(unit - 2 - at)), TL_PLACE_BITS);
    *end = vi_shift_right(vi_add(high, vi_set1(unit + 1 - at)), TL_PLACE_BITS);
}

/* Sets the boxes of triangles from their places; returns 0 if a box has more than 4x4 samples and must be exact. */
TL_INLINE int find_boxes_of_places(const walk_state *s, vm live, lane_batch *b)
{
    const vi *x = b->x_fx, *y = b->y_fx;
    const vi x_min = vi_min(vi_min(x[0], x[1]), x[2]), x_max = vi_max(vi_max(x[0], x[1]), x[2]);
    const vi y_min = vi_min(vi_min(y[0], y[1]), y[2]), y_max = vi_max(vi_max(y[0], y[1]), y[2]);
    const vi width = vi_sub(x_max, x_min), height = vi_sub(y_max, y_min);
    const vi widest = vi_set1(TL_MAX_BOX_PX << TL_PLACE_BITS);
    const vf one = vf_set1(1.0f), unit = vf_set1(TL_PLACE_UNIT);
    /* a special vertex has TL_SPECIAL for x: its triangle is too wide, or all of its vertices are special */
    const vm too_large = vm_or(vi_gt_unsigned(width, widest), vi_gt_unsigned(height, widest));
    vi left, right;
    b->single = vm_and(live, vm_or(too_large, vi_eq(x_min, vi_set1(TL_SPECIAL)))),
    b->drawn = vm_and_not(live, b->single);
    find_pixels_of_places(x_min, x_max, s->centre_x, &left, &right);
    find_pixels_of_places(y_min, y_max, s->centre_y, &b->top, &b->bottom);
    cut_boxes(s, left, right, b);
    b->xy = vf_mul(vf_max(vf_mul(vf_from_vi(width), unit), one), vf_max(vf_mul(vf_from_vi(height), unit), one));
    return !vm_any(vm_and(vm_and(b->drawn, has_box(b)), vi_gt(vi_max(b->n_cols, b->n_rows), vi_set1(TL_SMALL_BOX))));
}

/* Loads TL_LANES triangles, and sets their boxes. */
TL_INLINE void load_float_batch(const walk_state *s, tl_sink sink, const int32_t *corners, vm live, lane_batch *b)
{
    b->is_placed = 0;
    if (sink_has_depth(sink) && s->has_places) {
        for (int k = 0; k < 3; k++)
            vd_load_places(s->points->points, corners + k, &b->t.x[k], &b->t.y[k], &b->t.z[k], &b->x_fx[k],
                           &b->y_fx[k]);
        b->is_placed = find_boxes_of_places(s, live, b);
    } else {
        load_points(s->points, sink, corners, b->t.x, b->t.y, b->t.z);
    }
    if (!b->is_placed)
        find_boxes_of_points(s, sink, live, b);
}

/* Sets the first samples of boxes. */
TL_INLINE void place_float(const walk_state *s, tl_sink sink, vi col, vi row, vf xy, lane_exact *t)
{
    t->sample_x = vd_add(vd_from_vi(col), vd_set1(s->centre_x));
    t->sample_y = vd_add(vd_from_vi(row), vd_set1(s->centre_y));
    t->sample = first_samples(s, col, row);
    t->test = test_of(s, sink);
    t->xy = vf_mul(xy, vf_set1((float)s->points->band));
    t->on_grid = vm_first(0);
}

/* Planes give depth except for slivers, and where products leave the range of float64. */
#define TL_LEAST_BOX 1e-250
#define TL_MOST_EXTENT 1e120

/* Lists triangles without a depth plane as slivers, and removes them from the lanes; as in `plane_of_points`: extents
 * of lanes are in range. */
TL_INLINE void take_out_slivers(walk_state *s, lane_exact *t)
{
    const vd width = vd_sub(vd_max(vd_max(t->x[0], t->x[1]), t->x[2]), vd_min(vd_min(t->x[0], t->x[1]), t->x[2]));
    const vd height = vd_sub(vd_max(vd_max(t->y[0], t->y[1]), t->y[2]), vd_min(vd_min(t->y[0], t->y[1]), t->y[2]));
    const vd box = vd_mul(width, height),
             scaled = vd_mul(vd_abs(area_of_points(t->x, t->y)), vd_set1((double)(1 << TL_SLIVER_BITS)));
    const vm has_plane = vm_and(vd_ge(scaled, box), vd_ge(box, vd_set1(TL_LEAST_BOX)));
    const vm slivers = vm_and_not(t->live, has_plane);
    if (__builtin_expect(vm_any(slivers), 0)) {
        s->n_slivers += vi_compress(s->slivers + s->n_slivers, slivers, t->ids);
        t->live = vm_and(t->live, has_plane);
    }
}

/* Loads the triangles [i, i + TL_LANES) of a queue of n. */
TL_INLINE void pop_float(const walk_state *s, tl_sink sink, const box_queue *q, int i, int n, lane_exact *t)
{
    int32_t corners[3 * TL_LANES];
    pop_corners(s->snapped, s->limits.last_vertex, q, i, n, corners);
    load_points(s->points, sink, corners, t->x, t->y, t->z);
    t->ids = vi_load(q->id + i);
    t->live = vm_first(n - i);
    place_float(s, sink, vi_load(q->col + i), vi_load(q->row + i), vf_load(q->xy + i), t);
}

/* Sets the edge functions of loaded triangles.  of_boxes, a constant: boxes have up to 4x4 samples. */
TL_INLINE void setup_float(walk_state *s, tl_sink sink, lane_exact *t, int of_boxes)
{
    const vm good = s->may_be_on_grid ? find_on_grid(s, t, of_boxes) : vm_first(0);
    if (of_boxes) {
        set_box_edges(s, t, good);
    } else {
        find_turns(s, t, good);
        turn_points(t);
        if (sink_has_depth(sink))
            take_out_slivers(s, t);
        if (!s->may_be_on_grid || vm_any(vm_and_not(t->live, good)))
            set_float_edges(t);
        else
            for (int k = 0; k < 3; k++)
                t->e[k] = t->dx[k] = t->dy[k] = vf_set1(0.0f);
    }
    cull_turned(s, t);
    if (__builtin_expect(s->may_be_on_grid, 0)) {
        if (of_boxes)
            set_ties(t, good);
        else if (vm_any(good))
            set_grid_edges(t, good);
        s->may_be_on_grid = vm_any(good) ? s->may_be_on_grid - 1 : 0;
    }
}

/* The depth planes, by the operations of plane_of_points in single_float.c: equal bits. */
TL_INLINE lane_planes plane_of_lanes(const walk_state *s, const lane_exact *t)
{
    const vd zero = vd_set1(0.0);
    lane_planes p = {zero, zero, zero, t->sample_x, t->sample_y, t->x[0], t->y[0]};
    if (s->points->stride < 3)
        return p;
    const vd *z = t->z;
    /* swapping two corners changes the sign of both products and of the area, and no other bit */
    const vm is_turned = vm_and_not(t->turned, t->to_turn);
    const vd z1 = vd_select(is_turned, z[2], z[1]), z2 = vd_select(is_turned, z[1], z[2]);
    const vd x1 = vd_sub(t->x[1], t->x[0]), y1 = vd_sub(t->y[1], t->y[0]);
    const vd x2 = vd_sub(t->x[2], t->x[0]), y2 = vd_sub(t->y[2], t->y[0]);
    const vd d1 = vd_sub(z1, z[0]), d2 = vd_sub(z2, z[0]);
    const vd inverse = vd_div(vd_set1(1.0), vd_sub(vd_mul(x1, y2), vd_mul(y1, x2)));
    p.z0 = z[0];
    p.slope_x = vd_mul(vd_sub(vd_mul(d1, y2), vd_mul(d2, y1)), inverse);
    p.slope_y = vd_mul(vd_sub(vd_mul(d2, x1), vd_mul(d1, x2)), inverse);
    return p;
}

/* Removes triangles that are certainly culled. */
TL_INLINE void drop_turned(const walk_state *s, lane_batch *b)
{
    if (s->snapped->cull == TL_CULL_NONE)
        return;
    const vd *x = b->t.x, *y = b->t.y;
    const vd width = vd_sub(vd_max(vd_max(x[0], x[1]), x[2]), vd_min(vd_min(x[0], x[1]), x[2]));
    const vd height = vd_sub(vd_max(vd_max(y[0], y[1]), y[2]), vd_min(vd_min(y[0], y[1]), y[2]));
    const vd area = area_of_points(x, y), box = vd_mul(width, height);
    const vd bound = vd_add(vd_mul(box, vd_set1(0x1p-50)), vd_set1(1e-280)), zero = vd_set1(0.0);
    b->drawn = vm_and_not(b->drawn, vd_ge(s->snapped->cull == TL_CULL_BACK ? area : vd_sub(zero, area), bound));
}

/* Whether int32 counts the pixels of a window. */
TL_INLINE int is_near_0(const tl_window *window)
{
    const int64_t farthest = (int64_t)1 << 30;
    return is_near(window) && window->x_px + window->width < farthest && window->y_px + window->height < farthest;
}

/* The window lies within 2^48 pixels of 0, where centres and samples are exact in float64. */
static void start_float(walk_state *s, const tl_snapped *snapped, const tl_window *window, const tl_target *target)
{
    const int64_t limit = TL_PLACE_LIMIT_PX - TL_MAX_BOX_PX - 2;
    const double unit = 1.0 / (double)(1 << window->subpixel_bits);
    const int of_squares = window->test != TL_TEST_SAMPLE;
    start_walk(s, snapped, window, target);
    s->points = snapped->mesh.exact;
    s->centre_x = of_squares ? 0.0 : 0.5 + snapped->mesh.sample_x_fx * unit;
    s->centre_y = of_squares ? 0.0 : 0.5 + snapped->mesh.sample_y_fx * unit;
    s->is_far = !is_near_0(window), s->may_be_on_grid = 0;
    s->has_places = s->points->stride == TL_PLACED && max64(-window->x_px, window->x_px + window->width) <= limit &&
                    max64(-window->y_px, window->y_px + window->height) <= limit;
}

#endif
