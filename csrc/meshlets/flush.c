/* Draws the queues of a meshlet: boxes up to 4x4 sample by sample, larger ones by rows, both triangles of a pair at
 * once.
 * In: queues of triangles, their corners as pairs from the first sample.  Out: samples in the list, or in the
 * buffers. */
#ifndef TL_FLUSH_C
#define TL_FLUSH_C

#include <stdint.h>

#include "lanes/halves.h"
#include "lanes/lanes.h"
#include "raster/row_edges.h"
#include "meshlets/batch.h"
#include "meshlets/plane.c"
#include "meshlets/queues.c"
#include "meshlets/write.c"

#if TL_HAS_HALVES

/* Sixteen triangles of a queue. */
typedef struct {
    vm live;
    vi sample, size, triangle;
    vi e[3], dx[3], dy[3]; /* edge functions at the first sample, in whole pixels: >= 0 inside; and their sides */
    lane_plane plane;
} queued_lanes;

/* Less one unless the edge keeps its zero: it goes down, or is level and goes left. */
TL_INLINE vi less_side_bias(vi e, vi dx, vi dy)
{
    const vi key = vi_add(vi_shift_left(dy, 16), dx);
    return vi_select(vi_gt(vi_set1(0), key), e, vi_sub(e, vi_set1(1)));
}

TL_INLINE queued_lanes load_queued(meshlet_slot *slot, const lane_queue *q, int i)
{
    const vi v[3] = {vi_load(q->v0 + i), vi_load(q->v1 + i), vi_load(q->v2 + i)};
    queued_lanes t = {
        .sample = vi_load(q->sample + i), .size = vi_load(q->size + i), .triangle = vi_load(q->triangle + i)};
    t.live = vm_and(vm_first(q->n - i), vi_any_bit(t.size, t.size));
    t.live = vm_and_not(t.live, leave_slivers(slot, v, t.live, t.triangle));
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        const vi side = vi_sub_halves(v[next], v[k]);
        t.dx[k] = vi_signed_low(side), t.dy[k] = vi_signed_high(side);
        t.e[k] = vi_shift_right(less_side_bias(edge_at(v[k], v[next]), t.dx[k], t.dy[k]), TL_PX_BITS);
    }
    vi corner[3];
    pick_corners(slot, t.triangle, corner);
    t.plane = make_plane(slot, corner, v);
    return t;
}

static __attribute__((noinline)) void flush_small_boxes(meshlet_batch *s, meshlet_slot *slot)
{
    lane_queue *q = &s->small;
    const vd px = vd_set1(TL_PX);
    for (int i = 0; i < q->n; i += TL_LANES) {
        queued_lanes t = load_queued(slot, q, i);
        lane_plane *plane = &t.plane;
        const vi n_cols = vi_low_half(t.size), n_rows = vi_high_half(t.size),
                 name = vi_add(t.triangle, vi_set1(slot->name0));
        vd z_col[TL_SMALL_PX];
        for (int col = 0; col < TL_SMALL_PX; col++) {
            z_col[col] = vd_mul(plane->slope_x, plane->x);
            plane->x = vd_add(plane->x, px);
        }
#pragma GCC unroll 4
        for (int row = 0; row < TL_SMALL_PX; row++) {
            const vm in_row = vm_and(t.live, vi_gt(n_rows, vi_set1(row)));
            if (!vm_any(in_row))
                break;
            const vd z_row = vd_add(plane->z0, vd_mul(plane->slope_y, plane->y));
            plane->y = vd_sub(plane->y, px);
            vi e[3] = {t.e[0], t.e[1], t.e[2]};
#pragma GCC unroll 4
            for (int col = 0; col < TL_SMALL_PX; col++) {
                const vm in = vm_and(vm_and(in_row, vi_gt(n_cols, vi_set1(col))), vi_none_negative(e[0], e[1], e[2]));
                const vf depth = vf_add(vf_from_vd(vd_add(z_row, z_col[col])), vf_set1(0.0f));
                add_fragments(s, in, vi_add(t.sample, vi_set1(col - row * s->stride_px)), name, depth);
                for (int k = 0; k < 3; k++)
                    e[k] = vi_sub(e[k], t.dy[k]);
            }
            for (int k = 0; k < 3; k++)
                t.e[k] = vi_add(t.e[k], t.dx[k]);
        }
        make_fragment_room(s, 16 * TL_LANES);
    }
    q->n = 0;
}

/* The rows of sixteen triangles with boxes up to 16x16. */
typedef struct {
    int32_t bits[TL_MIDDLE_PX][TL_LANES] __attribute__((aligned(64)));
    double z[TL_MIDDLE_PX][TL_LANES] __attribute__((aligned(64)));
} middle_rows;

TL_INLINE void find_rows(queued_lanes *t, vi size, middle_rows *out)
{
    const vi zero = vi_set1(0), byte = vi_set1(0xff), n_cols = vi_and(size, byte);
    const vi own0 = vi_and(vi_high_half(size), byte), own1 = vi_shift_right_unsigned(size, 24);
    const int n_rows = vi_most(vi_and(vi_shift_right_unsigned(size, 8), byte));
    lane_edges r;
    sort_fixed_edges(t->e, t->dx, t->dy, &r);
    for (int row = 0; row < n_rows; row++) {
        vi begin, end;
        next_row(TL_FIXED, &r, n_cols, &begin, &end, NULL);
        const vm in = vm_and_not(vi_gt(own1, vi_set1(row)), vi_gt(own0, vi_set1(row)));
        vi_store_aligned(out->bits[row], vi_bit_ranges(begin, vi_select(in, vi_max(end, zero), zero)));
        vd_store(out->z[row], vd_add(t->plane.z0, vd_mul(t->plane.slope_y, t->plane.y)));
        t->plane.y = vd_sub(t->plane.y, vd_set1(TL_PX));
    }
}

TL_INLINE void flush_middle_boxes(meshlet_batch *s, meshlet_slot *slot, int is_farthest)
{
    lane_queue *q = &s->middle;
    const vd steps = vd_mul(vd_from_vi(vi_iota()), vd_set1(TL_PX));
    const int64_t stride = s->stride_px;
    for (int i = 0; i < q->n; i += TL_LANES) {
        queued_lanes t = load_queued(slot, q, i);
        const vi size = vi_select(t.live, t.size, vi_set1(0)); /* slivers are drawn by others */
        middle_rows rows;
        int32_t sizes[TL_LANES];
        double slope_x[TL_LANES], x[TL_LANES];
        vi_store(sizes, size);
        vd_store(slope_x, t.plane.slope_x);
        vd_store(x, t.plane.x);
        find_rows(&t, size, &rows);
        for (int k = 0; k < TL_LANES && i + k < q->n; k += 2) {
            const int32_t both = sizes[k] | sizes[k + 1]; /* they have the same box, or one of them none */
            const int n_rows = both >> 8 & 0xff, n_cols = both & 0xff;
            const int32_t id0 = slot->meshlet->names[q->triangle[i + k]] + s->first_id;
            const int32_t id1 = slot->meshlet->names[q->triangle[i + k + 1]] + s->first_id;
            const vd z0 = vd_mul(vd_set1(slope_x[k]), vd_add(vd_set1(x[k]), steps));
            const vd z1 = vd_mul(vd_set1(slope_x[k + 1]), vd_add(vd_set1(x[k + 1]), steps));
            const vi ids0 = vi_set1(id0), ids1 = vi_set1(id1);
            int64_t at = q->sample[i + k];
            if (n_cols <= TL_HALF_LANES) {
                for (int row = 0; row < n_rows; row++, at -= stride) {
                    const hm m0 = (hm)rows.bits[row][k], m1 = (hm)rows.bits[row][k + 1];
                    put_short_row(s, at, hm_or(m0, m1), hf_sum_two(rows.z[row][k], z0, rows.z[row][k + 1], z1, m1),
                                  hi_select(m1, hi_lower(ids1), hi_lower(ids0)), is_farthest);
                }
            } else {
                for (int row = 0; row < n_rows; row++, at -= stride) {
                    const vm m0 = (vm)rows.bits[row][k], m1 = (vm)rows.bits[row][k + 1];
                    put_row(s, at, vm_or(m0, m1), vf_sum_two(rows.z[row][k], z0, rows.z[row][k + 1], z1, m1),
                            vi_select(m1, ids1, ids0), is_farthest);
                }
            }
        }
    }
    q->n = 0;
}
TL_DEPTH_COPIES(flush_middle_boxes, (meshlet_batch * s, meshlet_slot *slot), s, slot)

/* Row constants of one triangle of each pair, of sixteen pairs. */
typedef struct {
    lane_edges edges;
    float start[3][TL_LANES], step[3][TL_LANES], inverse[3][TL_LANES];
    double z0[TL_LANES], slope_x[TL_LANES], slope_y[TL_LANES], x[TL_LANES], y[TL_LANES];
    int32_t sizes[TL_LANES];
} long_rows;

/* Sixteen rows of triangle k from `first` on: where they begin and end, and their depths at the first column. */
TL_INLINE void find_long_rows(const long_rows *r, int k, int first, vi *begin, vi *stop, double *z)
{
    const vi zero = vi_set1(0);
    const uint32_t size = (uint32_t)r->sizes[k];
    const int n_cols = (int)(size & 0xff), own0 = (int)(size >> 16 & 0xff) - first, own1 = (int)(size >> 24) - first;
    const vf row = vf_add(vf_from_vi(vi_iota()), vf_set1((float)first));
    vi end[3];
    for (int j = 0; j < 3; j++)
        end[j] = vi_floor(
            vf_mul(vf_add(vf_set1(r->start[j][k]), vf_mul(vf_set1(r->step[j][k]), row)), vf_set1(r->inverse[j][k])));
    if (vm_bits(r->edges.third_is_left) >> k & 1)
        end[0] = vi_min(end[0], end[2]);
    if (vm_bits(r->edges.third_is_right) >> k & 1)
        end[1] = vi_min(end[1], end[2]);
    const vm in = vm_and_not(vm_first(own1), vm_first(own0));
    *begin = vi_max(vi_sub(zero, end[0]), zero);
    *stop = vi_select(in, vi_min(vi_add(end[1], vi_set1(1)), vi_set1(n_cols)), zero);
    const vd y = vd_sub(vd_set1(r->y[k] - (double)TL_PX * first), vd_mul(vd_from_vi(vi_iota()), vd_set1(TL_PX)));
    vd_store(z, vd_add(vd_set1(r->z0[k]), vd_mul(vd_set1(r->slope_y[k]), y)));
}

/* The bits of columns [first, first + 16) of rows. */
TL_INLINE vi columns_of(vi begin, vi stop, int first)
{
    const vi zero = vi_set1(0), from = vi_set1(first);
    const vi last = vi_max(vi_min(vi_sub(stop, from), vi_set1(TL_LANES)), zero);
    return vi_and(vi_bit_ranges(vi_max(vi_sub(begin, from), zero), last), vi_set1(0xffff));
}

/* Rows [first, first + 16) of a pair. */
TL_INLINE void put_long_rows(meshlet_batch *s, const long_rows *r, int k, int first, int n_cols, int64_t sample,
                             vi ids0, vi ids1, int is_farthest)
{
    const vd steps = vd_mul(vd_from_vi(vi_iota()), vd_set1(TL_PX));
    vi begin[2], stop[2];
    double z[2][TL_LANES];
    for (int h = 0; h < 2; h++)
        find_long_rows(r, k + h, first, begin + h, stop + h, z[h]);
    for (int col = 0; col < n_cols; col += TL_LANES) {
        int32_t bits[2][TL_LANES] __attribute__((aligned(64)));
        const vi m0 = columns_of(begin[0], stop[0], col), m1 = columns_of(begin[1], stop[1], col);
        const unsigned rows = vm_bits(vi_any_bit(vi_or(m0, m1), vi_set1(-1)));
        if (!rows)
            continue;
        vi_store_aligned(bits[0], m0), vi_store_aligned(bits[1], m1);
        const int row0 = __builtin_ctz(rows), row1 = 32 - __builtin_clz(rows);
        const double from = (double)TL_PX * col;
        const vd z0 = vd_mul(vd_set1(r->slope_x[k]), vd_add(vd_set1(r->x[k] + from), steps));
        const vd z1 = vd_mul(vd_set1(r->slope_x[k + 1]), vd_add(vd_set1(r->x[k + 1] + from), steps));
        int64_t at = sample + col - (int64_t)(first + row0) * s->stride_px;
        if (n_cols - col <= TL_HALF_LANES) {
            for (int row = row0; row < row1; row++, at -= s->stride_px) {
                const hm second = (hm)bits[1][row];
                put_short_row(s, at, hm_or((hm)bits[0][row], second), hf_sum_two(z[0][row], z0, z[1][row], z1, second),
                              hi_select(second, hi_lower(ids1), hi_lower(ids0)), is_farthest);
            }
        } else {
            for (int row = row0; row < row1; row++, at -= s->stride_px) {
                const vm second = (vm)bits[1][row];
                put_row(s, at, vm_or((vm)bits[0][row], second), vf_sum_two(z[0][row], z0, z[1][row], z1, second),
                        vi_select(second, ids1, ids0), is_farthest);
            }
        }
    }
}

TL_INLINE void flush_long_boxes(meshlet_batch *s, meshlet_slot *slot, int is_farthest)
{
    lane_queue *q = &s->rows;
    for (int i = 0; i < q->n; i += TL_LANES) {
        const queued_lanes t = load_queued(slot, q, i);
        long_rows r;
        sort_fixed_edges(t.e, t.dx, t.dy, &r.edges);
        for (int j = 0; j < 3; j++) {
            vf_store(r.start[j], r.edges.start[j]);
            vf_store(r.step[j], r.edges.step[j]);
            vf_store(r.inverse[j], r.edges.inverse[j]);
        }
        vd_store(r.z0, t.plane.z0), vd_store(r.slope_x, t.plane.slope_x), vd_store(r.slope_y, t.plane.slope_y);
        vd_store(r.x, t.plane.x), vd_store(r.y, t.plane.y);
        vi_store(r.sizes, vi_select(t.live, t.size, vi_set1(0)));
        for (int k = 0; k < TL_LANES && i + k < q->n; k += 2) {
            const int32_t both = r.sizes[k] | r.sizes[k + 1];
            const int n_rows = both >> 8 & 0xff, n_cols = both & 0xff;
            const vi ids0 = vi_set1(slot->meshlet->names[q->triangle[i + k]] + s->first_id);
            const vi ids1 = vi_set1(slot->meshlet->names[q->triangle[i + k + 1]] + s->first_id);
            for (int first = 0; first < n_rows; first += TL_LANES)
                put_long_rows(s, &r, k, first, n_cols, q->sample[i + k], ids0, ids1, is_farthest);
        }
    }
    q->n = 0;
}
TL_DEPTH_COPIES(flush_long_boxes, (meshlet_batch * s, meshlet_slot *slot), s, slot)

#endif
#endif
