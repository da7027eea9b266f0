/* Boxes: triangles with boxes of up to 4x4 samples, at every sample of TL_LANES boxes.
 * In: triangles that have been loaded, or a queue.  Out: lists of samples.
 *
 * A sample at which the least of three edge functions lies beyond the band of doubt is decided by it; the others are
 * asked. */
#ifndef TL_BOXES_EXACT_C
#define TL_BOXES_EXACT_C

#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "exact/setup_exact.c"
#include "exact/sign.c"
#include "raster/alone.c"
#include "raster/batch.c"
#include "raster/fragments.h"
#include "raster/sink.c"

typedef vm box_masks[TL_SMALL_BOX][TL_SMALL_BOX];

/* The lanes whose boxes have a sample at a place. */
TL_INLINE vm in_box(vm live, vi n_cols, vi n_rows, int row, int col)
{
    return vm_and(live, vm_and(vi_gt(n_rows, vi_set1(row)), vi_gt(n_cols, vi_set1(col))));
}

/* Sets `in` to what lanes decide; returns the lanes that are in doubt at some sample, in the box or beside it. */
TL_INLINE vm test_boxes(const lane_exact *t, vi n_cols, vi n_rows, int size, box_masks in)
{
    const vf band = vf_select(t->on_grid, vf_set1(0.0f), t->band);
    vf closest = vf_set1(INFINITY);
    vf row_e[3] = {t->e[0], t->e[1], t->e[2]};
    for (int row = 0; row < size; row++) {
        vf e[3] = {row_e[0], row_e[1], row_e[2]};
        for (int col = 0; col < size; col++) {
            const vf least = vf_min(vf_min(e[0], e[1]), e[2]);
            in[row][col] = vm_and(in_box(t->live, n_cols, n_rows, row, col), vf_lt(band, least));
            closest = vf_min_size(closest, least);
            for (int k = 0; k < 3; k++)
                e[k] = vf_sub(e[k], t->dy[k]);
        }
        for (int k = 0; k < 3; k++)
            row_e[k] = vf_add(row_e[k], t->dx[k]);
    }
    return vm_and_not(vm_and(t->live, vf_ge(band, closest)), t->on_grid);
}

/* Samples of a vector of boxes that are in doubt: lane | place << 8, place = row * TL_SMALL_BOX + col. */
typedef struct {
    int n;
    int32_t codes[(TL_SMALL_BOX * TL_SMALL_BOX + 1) * TL_MAX_LANES];
} doubted_samples;

/* Decides samples in doubt, TL_LANES at a time by float64, then by the exact sign; sets the lanes of those inside in
 * the bits of their places. */
TL_INLINE void decide_samples(const lane_exact *t, const doubted_samples *d, unsigned *found, tl_exact_counts *counts)
{
    picked_points m;
    store_points_to_pick(t, &m);
    for (int i = 0; i < d->n; i += TL_LANES) {
        const vi code = vi_load(d->codes + i), lane = vi_and(code, vi_set1(0xff)), place = vi_shift_right(code, 8);
        const vd px = vd_add(vd_pick(m.sample_x, lane), vd_from_vi(vi_and(place, vi_set1(TL_SMALL_BOX - 1))));
        const vd py = vd_add(vd_pick(m.sample_y, lane), vd_from_vi(vi_shift_right(place, 2)));
        vd x[3], y[3];
        vm in = vm_first(d->n - i), out = vm_first(0);
        for (int k = 0; k < 3; k++)
            x[k] = vd_pick(m.x[k], lane), y[k] = vd_pick(m.y[k], lane);
        for (int k = 0; k < 3; k++) {
            const lane_sides_of_edge sides = sides_of_edge(x, y, k, px, py, t->test);
            in = vm_and(in, sides.inside), out = vm_or(out, sides.outside);
        }
        const unsigned inside = vm_bits(in);
        for (unsigned left = vm_bits(vm_and_not(vm_first(d->n - i), out)); left; left &= left - 1) {
            const int j = __builtin_ctz(left), k = d->codes[i + j] & 0xff, at = d->codes[i + j] >> 8;
            const exact_point p[3] = {{m.x[0][k], m.y[0][k]}, {m.x[1][k], m.y[1][k]}, {m.x[2][k], m.y[2][k]}};
            const exact_point sample = {m.sample_x[k] + (at & (TL_SMALL_BOX - 1)), m.sample_y[k] + (at >> 2)};
            if (inside >> j & 1 || is_inside(p, sample, t->test, counts))
                found[at] |= 1u << k;
        }
    }
}

/* Decides the samples in doubt: on the grid by lanes, then by float64, then by the exact sign. */
static __attribute__((noinline)) void ask_boxes(exact_state *s, lane_exact *t, vi n_cols, vi n_rows, int size,
                                                box_masks in)
{
    unsigned found[TL_SMALL_BOX * TL_SMALL_BOX] = {0};
    doubted_samples d;
    d.n = 0;
    turn_points(t);
    try_grid(s, t, 1);
    const vf band = vf_select(t->on_grid, vf_set1(0.0f), t->band);
    const vf below = vf_sub(vf_set1(0.0f), band);
    for (int row = 0; row < size; row++) {
        vf e[3] = {t->e[0], t->e[1], t->e[2]};
        for (int col = 0; col < size; col++) {
            const vm box = in_box(t->live, n_cols, n_rows, row, col);
            const vf least = vf_min(vf_min(e[0], e[1]), e[2]);
            in[row][col] = vm_and(box, vf_lt(band, least));
            const vm near = vm_and_not(vm_and_not(vm_and(box, vf_ge(least, below)), in[row][col]), t->on_grid);
            vi_compress(d.codes + d.n, near, vi_add(vi_iota(), vi_set1((row * TL_SMALL_BOX + col) << 8)));
            d.n += __builtin_popcount(vm_bits(near));
            for (int k = 0; k < 3; k++)
                e[k] = vf_sub(e[k], t->dy[k]);
        }
        for (int k = 0; k < 3; k++)
            t->e[k] = vf_add(t->e[k], t->dx[k]);
    }
    s->counts->n_asked += d.n;
    if (!d.n)
        return;
    vi_store(d.codes + d.n, vi_set1(0));
    decide_samples(t, &d, found, s->counts);
    for (int row = 0; row < size; row++)
        for (int col = 0; col < size; col++)
            in[row][col] = vm_or(in[row][col], vm_from_bits(found[row * TL_SMALL_BOX + col]));
}

/* Writes a full list out; returns its length. */
TL_INLINE int make_exact_room(exact_state *s, int n)
{
    if (n <= TL_FRAGMENTS)
        return n;
    flush_fragments(s->target, &s->fragments, n);
    return 0;
}

/* The samples of boxes of up to 2x2: the first of each in one go, as draw_tiny in batch.c; most cover no other. */
TL_INLINE int emit_tiny(exact_state *s, tl_sink sink, box_masks in, vi sample, vi id, const vd *z_row, const vd *z_col,
                        int n)
{
    fragment_list *f = &s->fragments;
    const vi stride = vi_set1((int32_t)s->target->stride_px), one = vi_set1(1);
    const vm first01 = vm_and_not(in[0][1], in[0][0]), upper = vm_or(in[0][0], in[0][1]);
    const vm first10 = vm_and_not(in[1][0], upper), first11 = vm_and_not(in[1][1], vm_or(upper, in[1][0]));
    const vm on_right = vm_or(first01, first11), below = vm_or(first10, first11);
    const vm more[3] = {vm_and_not(in[0][1], first01), vm_and_not(in[1][0], first10), vm_and_not(in[1][1], first11)};
    const vi right = vi_select(on_right, vi_add(sample, one), sample);
    vf depth = vf_set1(0.0f);
    if (sink_has_depth(sink))
        depth = sum_depth(vd_select(below, z_row[1], z_row[0]), vd_select(on_right, z_col[1], z_col[0]));
    n = emit(f, n, sink, vm_or(upper, vm_or(in[1][0], in[1][1])), vi_select(below, vi_add(right, stride), right), id,
             depth);
    for (int k = 0; k < 3; k++) {
        const int row = k > 0, col = k != 1;
        if (vm_any(more[k]))
            n = emit(f, n, sink, more[k], vi_add(sample, vi_set1(row * (int32_t)s->target->stride_px + col)), id,
                     sink_has_depth(sink) ? sum_depth(z_row[row], z_col[col]) : depth);
    }
    return n;
}

/* Leaves out the samples of triangles that have no depth plane, which are put by. */
TL_INLINE void take_out_sliver_samples(exact_state *s, lane_exact *t, int size, box_masks in)
{
    const int n = s->n_slivers;
    take_out_slivers(s, t);
    if (__builtin_expect(s->n_slivers > n, 0))
        for (int row = 0; row < size; row++)
            for (int col = 0; col < size; col++)
                in[row][col] = vm_and(in[row][col], t->live);
}

/* The samples of TL_LANES boxes that have been loaded and placed, to a list of n; returns its new length. */
TL_INLINE int draw_exact_boxes(exact_state *s, tl_sink sink, lane_exact *t, vi n_cols, vi n_rows, int size, int n)
{
    const int32_t stride = (int32_t)s->target->stride_px;
    exact_planes p;
    box_masks in;
    vd z_col[TL_SMALL_BOX], z_tiny[2];
    setup_exact(s, sink, t, 1);
    if (__builtin_expect(vm_any(test_boxes(t, n_cols, n_rows, size, in)), 0)) {
        lane_exact own = *t;
        ask_boxes(s, &own, n_cols, n_rows, size, in);
    }
    const vi id = names_of(s->mesh, t->live, t->ids), sample = t->sample;
    if (sink_has_depth(sink)) {
        take_out_sliver_samples(s, t, size, in);
        p = plane_of_lanes(s, t);
        for (int col = 0; col < size; col++)
            z_col[col] = col_depth(&p, t, col);
    }
    if (TL_LANES > 1 && size == 2) {
        for (int row = 0; sink_has_depth(sink) && row < 2; row++)
            z_tiny[row] = row_depth(&p, t, row);
        n = emit_tiny(s, sink, in, sample, id, z_tiny, z_col, n);
        return make_exact_room(s, n);
    }
    for (int row = 0; row < size; row++) {
        vd z_row;
        if (sink_has_depth(sink))
            z_row = row_depth(&p, t, row);
        for (int col = 0; col < size; col++)
            if (TL_LANES > 1 || vm_any(in[row][col]))
                n = emit(&s->fragments, n, sink, in[row][col], vi_add(sample, vi_set1(row * stride + col)), id,
                         sink_has_depth(sink) ? sum_depth(z_row, z_col[col]) : vf_set1(0.0f));
        if ((row & 1) == 1)
            n = make_exact_room(s, n);
    }
    return n;
}

/* Boxes of up to 4x4 samples. */
TL_INLINE void flush_small_exact(exact_state *s, tl_sink sink)
{
    const box_queue *q = &s->small.boxes;
    int n_fragments = s->fragments.n;
    for (int i = 0; i < q->n; i += TL_LANES) {
        lane_exact t;
        const vi box = vi_load(q->size + i);
        pop_exact(s, sink, &s->small, i, q->n, &t);
        measure_points(&t);
        n_fragments = draw_exact_boxes(s, sink, &t, vi_and(box, vi_set1(0xffff)), vi_shift_right(box, 16), TL_SMALL_BOX,
                                       n_fragments);
    }
    s->small.boxes.n = 0;
    s->fragments.n = n_fragments;
}

TL_LIST_COPIES(flush_small_exact, (exact_state * s), s)

#endif
