/* Fixed: TL_LANES triangles at a time with snapped vertices, in 32-bit lanes. In: vertex records and triangles.  Out:
 * boxes, edge functions, depth planes; the triangles that do not fit 32 bits.
 *
 * Range: extents of at most TL_MAX_BOX_PX pixels of 2^8, so |dx|, |dy| < 2^14, doubled relative coordinates fit 16
 * bits, products 2^30, and doubled edge functions 2^29 (see fixed.h).  Squares and several samples: two pixels less and
 * at most 8 bits, so that this holds for corners of pixels up to a pixel outside the extent, except that doubled edge
 * functions are below 2^30. */
#ifndef TL_TRIANGLES_FIXED_C
#define TL_TRIANGLES_FIXED_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "vertex/setup.c"
#include "sink/sink.c"
#include "raster/state.h"

TL_INLINE void load_corners(const walk_state *s, const int32_t *corners, lane_corners *c)
{
    const tl_vertex *vertices = s->snapped->mesh.vertices;
    load_vertices(vertices, corners, &c->x[0], &c->y[0], &c->z[0]);
    load_vertices(vertices, corners + s->limits.second, &c->x[1], &c->y[1], &c->z[1]);
    load_vertices(vertices, corners + s->limits.third, &c->x[2], &c->y[2], &c->z[2]);
    for (int k = 0; k < 3; k++) {
        c->x[k] = vi_sub(c->x[k], vi_set1(s->snapped->mesh.sample_x_fx));
        c->y[k] = vi_sub(c->y[k], vi_set1(s->snapped->mesh.sample_y_fx));
    }
}

/* Twice the signed area; exact where the extents are in range. */
TL_INLINE vi area_lanes(const lane_corners *c)
{
    const vi x1 = vi_sub(c->x[1], c->x[0]), y1 = vi_sub(c->y[1], c->y[0]);
    const vi x2 = vi_sub(c->x[2], c->x[0]), y2 = vi_sub(c->y[2], c->y[0]);
    return vi_sub(vi_mul(x1, y2), vi_mul(y1, x2));
}

/* The pixels of an extent, see `round_extent`. */
TL_INLINE vi extent_pixels(vi x_fx, int32_t round, int bits)
{
    return vi_shift_right(vi_add(x_fx, vi_set1(round)), bits);
}

/* Loads TL_LANES triangles, and finds those that fit lanes and show the side that is drawn. */
TL_INLINE void load_fixed_batch(const walk_state *s, const int32_t *corners, vm live, lane_batch *b)
{
    const batch_limits *limits = &s->limits;
    const vi zero = vi_set1(0), max_extent = vi_set1(limits->max_extent);
    load_corners(s, corners, &b->c);
    b->extents = extents_of(&b->c);
    b->single = vm_and(live, is_single(&b->extents, max_extent, limits->special_x));
    b->area = area_lanes(&b->c);
    b->absolute = s->snapped->cull == TL_CULL_NONE ? vi_max(b->area, vi_sub(zero, b->area)) : b->area;
    b->drawn = vm_and_not(vm_and(live, vi_gt(b->absolute, zero)), b->single);
}

TL_INLINE void find_fixed_boxes(const walk_state *s, lane_batch *b)
{
    const extent_rounding round = s->limits.round;
    const int bits = s->window->subpixel_bits;
    b->top = extent_pixels(b->extents.y_min, round.first, bits);
    b->bottom = extent_pixels(b->extents.y_max, round.end, bits);
    cut_boxes(s, extent_pixels(b->extents.x_min, round.first, bits), extent_pixels(b->extents.x_max, round.end, bits),
              b);
}

TL_INLINE void setup_edges_lanes(lane_triangles *t, const tl_window *window, tl_sink sink)
{
    const int bits = window->subpixel_bits;
    const int of_squares = (sink == TL_SINK_MASK || sink == TL_SINK_COUNT) && window->test != TL_TEST_SAMPLE;
    for (int k = 0; k < 3; k++) {
        const vi doubled = vi_sub(vi_mul(t->dy[k], t->x[k]), vi_mul(t->dx[k], t->y[k]));
        if (of_squares) { /* from the centre to the tested corner: half a pixel in x and in y */
            const vi zero = vi_set1(0), is_outer = vi_set1(window->test == TL_TEST_OUTER);
            const vi sides = vi_add(vi_max(t->dx[k], vi_sub(zero, t->dx[k])), vi_max(t->dy[k], vi_sub(zero, t->dy[k])));
            const vi reach = vi_shift_left(sides, bits);
            const vi inwards = window->test == TL_TEST_OUTER ? reach : vi_sub(zero, reach);
            t->e[k] = vi_shift_right(vi_sub(vi_add(doubled, inwards), is_outer), bits + 1);
            continue;
        }
        /* left: dy < 0, top: dy = 0 and dx > 0; as one number, |dx| < 2^15 */
        const vm top_left = vi_gt(vi_set1(0), vi_sub(vi_shift_left(t->dy[k], 16), t->dx[k]));
        const vi biased = vi_select(top_left, doubled, vi_sub(doubled, vi_set1(1)));
        t->e[k] = sink == TL_SINK_SAMPLES ? biased : vi_shift_right(biased, bits + 1);
    }
}

/* Swaps corners so that areas are positive, and places the triangles relative to the first samples of their boxes. */
TL_INLINE void place_triangles(const walk_state *s, tl_sink sink, const lane_corners *c, vi col, vi row,
                               lane_triangles *t, vd *z)
{
    const int bits = s->window->subpixel_bits, either_turn = s->snapped->cull == TL_CULL_NONE;
    const vi centre_x = vi_add(vi_shift_left(col, bits + 1), vi_set1(1 << bits));
    const vi centre_y = vi_add(vi_shift_left(row, bits + 1), vi_set1(1 << bits));
    vi x[3] = {c->x[0], c->x[1], c->x[2]}, y[3] = {c->y[0], c->y[1], c->y[2]};
    for (int k = 0; sink_has_depth(sink) && k < 3; k++)
        z[k] = vd_from_vz(c->z[k]);
    if (either_turn) {
        const vm turn = vi_gt(vi_set1(0), area_lanes(c));
        x[1] = vi_select(turn, c->x[2], c->x[1]), y[1] = vi_select(turn, c->y[2], c->y[1]);
        x[2] = vi_select(turn, c->x[1], c->x[2]), y[2] = vi_select(turn, c->y[1], c->y[2]);
        if (sink_has_depth(sink)) {
            const vd z1 = z[1];
            z[1] = vd_select(turn, z[2], z1);
            z[2] = vd_select(turn, z1, z[2]);
        }
    }
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        t->x[k] = vi_sub(vi_add(x[k], x[k]), centre_x);
        t->y[k] = vi_sub(vi_add(y[k], y[k]), centre_y);
        t->dx[k] = vi_sub(x[next], x[k]);
        t->dy[k] = vi_sub(y[next], y[k]);
    }
    t->sample = first_samples(s, col, row);
    setup_edges_lanes(t, s->window, sink);
}

/* The depth planes, by the operations of setup_plane in setup.c: equal bits. */
TL_INLINE lane_planes plane_lanes(const lane_triangles *t, const vd *z)
{
    const vd x1 = vd_from_vi(t->dx[0]), y1 = vd_from_vi(t->dy[0]);
    const vi x2i = vi_sub(vi_set1(0), t->dx[2]), y2i = vi_sub(vi_set1(0), t->dy[2]);
    const vd x2 = vd_from_vi(x2i), y2 = vd_from_vi(y2i), d1 = vd_sub(z[1], z[0]), d2 = vd_sub(z[2], z[0]);
    const vd area = vd_from_vi(vi_sub(vi_mul(t->dx[0], y2i), vi_mul(t->dy[0], x2i))); /* exact: below 2^29 */
    const vd inverse = vd_div(vd_set1(0.5), area);
    return (lane_planes){
        .z0 = z[0],
        .slope_x = vd_mul(vd_sub(vd_mul(d1, y2), vd_mul(d2, y1)), inverse),
        .slope_y = vd_mul(vd_sub(vd_mul(d2, x1), vd_mul(d1, x2)), inverse),
        .x = vd_from_vi(vi_sub(vi_set1(0), t->x[0])),
        .y = vd_from_vi(vi_sub(vi_set1(0), t->y[0])),
        .x0 = vd_set1(0.0),
        .y0 = vd_set1(0.0),
    };
}

/* Loads the triangles [i, i + TL_LANES) of a queue of n. */
TL_INLINE void pop_fixed(const walk_state *s, tl_sink sink, const box_queue *q, int i, int n, lane_triangles *t, vd *z)
{
    int32_t corners[3 * TL_LANES];
    lane_corners c;
    pop_corners(s->snapped, s->limits.last_vertex, q, i, n, corners);
    load_corners(s, corners, &c);
    place_triangles(s, sink, &c, vi_load(q->col + i), vi_load(q->row + i), t, z);
}

/* Starts a pass for triangles that cover the centres of pixels. */
static void start_fixed(walk_state *s, const tl_snapped *snapped, const tl_window *window, const tl_target *target)
{
    const int bits = window->subpixel_bits, is_back = snapped->cull == TL_CULL_BACK;
    start_walk(s, snapped, window, target);
    s->limits.max_extent = TL_MAX_BOX_PX << (bits < 8 ? bits : 8);
    s->limits.round = round_extent(window);
    s->limits.special_x = (int32_t)((uint32_t)TL_SPECIAL - (uint32_t)snapped->mesh.sample_x_fx);
    s->limits.second = is_back ? 2 : 1, s->limits.third = is_back ? 1 : 2;
}

#endif
