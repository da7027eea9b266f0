/* Sorts the triangles of a meshlet with boxes over 2x2 into queues by size, pairs of them together.
 * In: a meshlet with snapped vertices.  Out: queues of boxes up to 4x4, up to 16x16 and up to 62x62, and a bit for each
 * triangle that is larger. */
#ifndef TL_QUEUES_C
#define TL_QUEUES_C

#include <stdint.h>

#include "lanes/halves.h"
#include "lanes/lanes.h"
#include "meshlets/batch.h"
#include "meshlets/plane.c"
#include "meshlets/tiny.c"
#include "meshlets/turn.c"

#if TL_HAS_HALVES

#define TL_SMALL_PX 4
#define TL_MIDDLE_PX 16

/* Sixteen triangles, partners in neighbouring lanes: corners, and boxes of samples [col0, col1) x [row0, row1). */
typedef struct {
    vi x[3], y[3];
    vi col0, col1, row0, row1;
    vi triangle;
} lane_boxes;

TL_INLINE void push_lanes(lane_queue *q, vm m, const vi *v, vi sample, vi size, vi triangle)
{
    const int n = q->n;
    vi_compress(q->v0 + n, m, v[0]);
    vi_compress(q->v1 + n, m, v[1]);
    vi_compress(q->v2 + n, m, v[2]);
    vi_compress(q->sample + n, m, sample);
    vi_compress(q->size + n, m, size);
    q->n = n + vi_compress(q->triangle + n, m, triangle);
}

/* Corners as seen from the sample at (col, row), as pairs. */
TL_INLINE void from_sample(const lane_boxes *b, vi col, vi row, vi *v)
{
    const vi half = vi_set1(TL_PX / 2), x = vi_add(vi_shift_left(col, TL_PX_BITS), half);
    const vi y = vi_add(vi_shift_left(row, TL_PX_BITS), half);
    for (int k = 0; k < 3; k++)
        v[k] = vi_from_halves(vi_sub(b->x[k], x), vi_shift_left(vi_sub(b->y[k], y), 16));
}

/* The partners of the lanes of m; these as well. */
TL_INLINE vm partners(vm m) { return (vm)((m << 1 & 0xaaaa) | (m >> 1 & 0x5555)); }
TL_INLINE vm with_partners(vm m) { return vm_or(m, partners(m)); }

/* Columns, rows, and which rows [from, to) of these are the triangle's own: horizontal edges end nothing else. */
TL_INLINE vi box_size(vi n_cols, vi n_rows, vi from, vi to)
{
    return vi_or(vi_or(n_cols, vi_shift_left(n_rows, 8)), vi_or(vi_shift_left(from, 16), vi_shift_left(to, 24)));
}

/* Puts the triangles in m into queues: small ones alone, others with their partner, measured from the first sample of
 * the box of both, partners that draw nothing with size 0.  `folded`: the
 * two may cover the same samples. */
TL_INLINE void queue_boxes(meshlet_batch *s, vm m, vm folded, const lane_boxes *b, int32_t base)
{
    const vi outside = vi_set1(1 << 20), none = vi_set1(-(1 << 20)), stride = vi_set1(s->stride_px);
    const vi left = vi_select(m, b->col0, outside), right = vi_select(m, b->col1, none);
    const vi below = vi_select(m, b->row0, outside), above = vi_select(m, b->row1, none);
    const vi col0 = vi_min(left, vi_swap_neighbours(left)), col1 = vi_max(right, vi_swap_neighbours(right));
    const vi row0 = vi_min(below, vi_swap_neighbours(below)), row1 = vi_max(above, vi_swap_neighbours(above));
    const vi n_cols = vi_sub(col1, col0), n_rows = vi_sub(row1, row0), longer = vi_max(n_cols, n_rows);
    const vi own_cols = vi_sub(b->col1, b->col0), own_rows = vi_sub(b->row1, b->row0);
    const vm any = with_partners(m);
    vm small = vm_and_not(m, vi_gt(vi_max(own_cols, own_rows), vi_set1(TL_SMALL_PX)));
    const vm small_or_none = vm_or(small, (vm)~m); /* both small, or the only one */
    small &= (vm)((small_or_none << 1 | 0x5555) & (small_or_none >> 1 | 0xaaaa));
    const vm of_small = with_partners(small), over = vm_and(folded, vm_and(m, partners(m)));
    const vm fits = vm_and_not(vm_and_not(any, vi_gt(longer, vi_set1(TL_MAX_LANE_PX))), over);
    /* together too large, or one over the other: one by one */
    const vm apart = vm_and_not(vm_and_not(any, fits), of_small);
    const vm middle = vm_and_not(vm_and_not(fits, vi_gt(longer, vi_set1(TL_MIDDLE_PX))), of_small);
    const vm rows = vm_and_not(vm_and_not(fits, of_small), middle);
    vi v[3];
    if (vm_any(small)) {
        from_sample(b, b->col0, b->row0, v);
        const vi sample = vi_add(vi_sub(b->col0, vi_mul(b->row0, stride)), vi_set1(base));
        push_lanes(&s->small, small, v, sample, vi_or(own_cols, vi_shift_left(own_rows, 16)), b->triangle);
    }
    if (!vm_any(vm_or(vm_or(middle, rows), apart)))
        return;
    const vi col = vi_select(apart, b->col0, col0), row = vi_select(apart, b->row0, row0);
    from_sample(b, col, row, v);
    const vi sample = vi_add(vi_sub(col, vi_mul(row, stride)), vi_set1(base)), zero = vi_set1(0);
    const vi size = vi_select(m, box_size(n_cols, n_rows, vi_sub(b->row0, row), vi_sub(b->row1, row)), zero);
    if (vm_any(middle))
        push_lanes(&s->middle, middle, v, sample, size, b->triangle);
    if (vm_any(rows))
        push_lanes(&s->rows, rows, v, sample, size, b->triangle);
    for (unsigned rest = vm_bits(vm_and(apart, m)); __builtin_expect(rest != 0, 0); rest &= rest - 1) {
        const vm lane = vm_from_bits(rest & -rest);
        push_lanes(&s->rows, lane, v, sample, box_size(own_cols, own_rows, zero, own_rows), b->triangle);
        push_lanes(&s->rows, lane, v, sample, zero, b->triangle);
    }
}

/* The larger triangles of a meshlet of 128 x 128 pixels. */
TL_INLINE void queue_larger(meshlet_batch *s, meshlet_slot *slot)
{
    for (int i = 0; i < slot->n_larger; i += TL_LANES) {
        const vi triangle = vi_bytes_at(slot->larger + i), zero = vi_set1(0);
        vm live = vm_first(slot->n_larger - i);
        vi v[3];
        pick_triangles(slot, triangle, v);
        const vi extent = vi_sub_halves(vh_max(vh_max(v[0], v[1]), v[2]), vh_min(vh_min(v[0], v[1]), v[2]));
        const vi first = first_sample(slot, v), last = last_sample(slot, v);
        lane_boxes b = {.col0 = vi_low_half(first),
                        .col1 = vi_low_half(last),
                        .row0 = vi_high_half(first),
                        .row1 = vi_high_half(last),
                        .triangle = triangle};
        const vi n_cols = vi_sub(b.col1, b.col0), n_rows = vi_sub(b.row1, b.row0);
        /* those with boxes up to 2x2 have been drawn */
        live = vm_and(live, vm_and(vi_gt(vi_min(n_cols, n_rows), zero), vi_gt(vi_max(n_cols, n_rows), vi_set1(2))));
        const vi area = edge_at(vi_sub_halves(v[1], v[0]), vi_sub_halves(v[2], v[0]));
        live = vm_and(live, vi_gt(area, zero));
        const vm is_large =
            vm_and(live, vi_gt(vi_max(vi_low_half(extent), vi_high_half(extent)), vi_set1(TL_MAX_LANE_PX * TL_PX)));
        leave_lanes(slot, is_large, triangle);
        live = vm_and_not(live, is_large);
        if (!vm_any(live))
            continue;
        for (int k = 0; k < 3; k++)
            b.x[k] = vi_low_half(v[k]), b.y[k] = vi_high_half(v[k]);
        queue_boxes(s, live, is_folded(slot, b.triangle), &b, slot->base);
    }
}

/* All triangles of a meshlet with 32-bit vertices. */
TL_INLINE void queue_wide(meshlet_batch *s, meshlet_slot *slot)
{
    const vi left = vi_set1(-slot->at.left_px), right = vi_set1(s->width - slot->at.left_px);
    const vi lowest = vi_set1(slot->at.below_px - s->row1), highest = vi_set1(slot->at.below_px - s->row0);
    for (int i = 0; i < slot->n_triangles; i += TL_LANES) {
        lane_boxes b = {.triangle = vi_add(vi_set1(i), vi_iota())};
        vi corner[3];
        pick_corners(slot, b.triangle, corner);
        for (int k = 0; k < 3; k++)
            b.x[k] = vi_pick_64(s->wide_x, corner[k]), b.y[k] = vi_pick_64(s->wide_y, corner[k]);
        const vi x_min = vi_min(vi_min(b.x[0], b.x[1]), b.x[2]), x_max = vi_max(vi_max(b.x[0], b.x[1]), b.x[2]);
        const vi y_min = vi_min(vi_min(b.y[0], b.y[1]), b.y[2]), y_max = vi_max(vi_max(b.y[0], b.y[1]), b.y[2]);
        b.col0 = vi_max(vi_shift_right(vi_add(x_min, vi_set1(TL_ROUND_X)), TL_PX_BITS), left);
        b.col1 = vi_min(vi_shift_right(vi_add(x_max, vi_set1(TL_ROUND_X)), TL_PX_BITS), right);
        b.row0 = vi_max(vi_shift_right(vi_add(y_min, vi_set1(TL_ROUND_Y)), TL_PX_BITS), lowest);
        b.row1 = vi_min(vi_shift_right(vi_add(y_max, vi_set1(TL_ROUND_Y)), TL_PX_BITS), highest);
        vm live = vm_and(vi_gt(b.col1, b.col0), vi_gt(b.row1, b.row0));
        if (!vm_any(live))
            continue;
        const vi longer = vi_max(vi_sub(x_max, x_min), vi_sub(y_max, y_min));
        const vm is_large = vm_and(live, vi_gt(longer, vi_set1(TL_MAX_LANE_PX * TL_PX)));
        leave_lanes(slot, is_large, b.triangle);
        live = vm_and_not(live, is_large);
        /* twice the area, below 2^29 */
        live = vm_and(live, vi_gt(vi_mul(vi_sub(b.x[1], b.x[0]), vi_sub(b.y[2], b.y[0])),
                                  vi_mul(vi_sub(b.y[1], b.y[0]), vi_sub(b.x[2], b.x[0]))));
        if (vm_any(live))
            queue_boxes(s, live, is_folded(slot, b.triangle), &b, slot->base);
    }
}

#endif
#endif
