/* Boxes: triangles with boxes of up to 4x4 samples, at every sample of TL_LANES boxes.
 * In: loaded triangles, or a queue.  Out: lists of samples.
 *
 * TL_FLOAT: the least of three edge functions decides a sample if it lies outside of the band of doubt; other samples
 * are refined. */
#ifndef TL_BOXES_C
#define TL_BOXES_C

#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/exact.h"
#include "exact/sign.c"
#include "sink/fragments.h"
#include "sink/sink.c"
#include "raster/single_fixed.c"
#include "raster/state.h"
#include "raster/triangles_fixed.c"
#include "raster/triangles_float.c"

typedef vm box_masks[TL_SMALL_BOX][TL_SMALL_BOX];

/* The lanes whose box has a sample at (row, col). */
TL_INLINE vm in_box(vm live, vi n_cols, vi n_rows, int row, int col)
{
    return vm_and(live, vm_and(vi_gt(n_rows, vi_set1(row)), vi_gt(n_cols, vi_set1(col))));
}

/* The depths of samples that are (x, y) from corner 0. */
TL_INLINE vf plane_depth(const lane_planes *p, vd x, vd y)
{
    return sum_depth(vd_add(p->z0, vd_mul(p->slope_y, y)), vd_mul(p->slope_x, x));
}

/* Emits the samples of boxes of up to 2x2.  The first sample of every box is emitted in one step: most triangles cover
 * no other. */
TL_INLINE void emit_tiny(walk_state *s, tl_geometry g, tl_sink sink, box_masks in, vi sample, vi id,
                         const lane_planes *p)
{
    fragment_list *f = &s->fragments;
    const vi stride = vi_set1((int32_t)s->target->stride_px), one = vi_set1(1);
    const vm first01 = vm_and_not(in[0][1], in[0][0]), upper = vm_or(in[0][0], in[0][1]);
    const vm first10 = vm_and_not(in[1][0], upper), first11 = vm_and_not(in[1][1], vm_or(upper, in[1][0]));
    const vm on_right = vm_or(first01, first11), below = vm_or(first10, first11);
    const vm more[3] = {vm_and_not(in[0][1], first01), vm_and_not(in[1][0], first10), vm_and_not(in[1][1], first11)};
    const vi right = vi_select(on_right, vi_add(sample, one), sample);
    vf depth = vf_set1(0.0f);
    vd x[2], y[2];
    if (sink_has_depth(sink)) {
        const vd step = vd_set1(plane_step(s, g));
        x[0] = p->x, x[1] = vd_add(p->x, step), y[0] = p->y, y[1] = vd_add(p->y, step);
        for (int k = 0; g == TL_FLOAT && k < 2; k++)
            x[k] = vd_sub(x[k], p->x0), y[k] = vd_sub(y[k], p->y0);
        depth = plane_depth(p, vd_select(on_right, x[1], x[0]), vd_select(below, y[1], y[0]));
    }
    int n = emit(f, f->n, sink, vm_or(upper, vm_or(in[1][0], in[1][1])), vi_select(below, vi_add(right, stride), right),
                 id, depth);
    for (int k = 0; k < 3; k++) {
        const int row = k > 0, col = k != 1;
        if (vm_any(more[k]))
            n = emit(f, n, sink, more[k], vi_add(sample, vi_set1(row * (int32_t)s->target->stride_px + col)), id,
                     sink_has_depth(sink) ? plane_depth(p, x[col], y[row]) : depth);
    }
    f->n = make_room(s, n);
}

/* ---- TL_FIXED -------------------------------------------------------------------------------------------- */

/* Draws boxes of up to 2x2 samples of loaded triangles. */
TL_INLINE void draw_tiny_fixed(walk_state *s, tl_sink sink, const lane_batch *b, vm live, vi id)
{
    lane_triangles t;
    box_masks in;
    lane_planes p;
    vd z[3];
    place_triangles(s, sink, &b->c, b->col, b->row, &t, z);
    for (int row = 0; row < 2; row++)
        for (int col = 0; col < 2; col++) {
            vi all = vi_set1(0);
            for (int k = 0; k < 3; k++) {
                const vi below = row ? vi_add(t.e[k], t.dx[k]) : t.e[k];
                all = vi_or(all, col ? vi_sub(below, t.dy[k]) : below);
            }
            in[row][col] = vm_and(in_box(live, b->n_cols, b->n_rows, row, col), vi_gt(all, vi_set1(-1)));
        }
    if (!vm_any(vm_or(vm_or(in[0][0], in[0][1]), vm_or(in[1][0], in[1][1]))))
        return;
    if (sink_has_depth(sink))
        p = plane_lanes(&t, z);
    emit_tiny(s, TL_FIXED, sink, in, t.sample, names_of(s->snapped, live, id), &p);
}

TL_INLINE void flush_small_fixed(walk_state *s, tl_sink sink)
{
    box_queue *q = &s->small;
    const int bits = s->window->subpixel_bits, n = q->n;
    const int32_t stride = (int32_t)s->target->stride_px;
    const vd step = vd_set1((double)(2 << bits));
    int n_fragments = s->fragments.n;
    q->n = 0;
    for (int i = 0; i < n; i += TL_LANES) {
        lane_triangles t;
        lane_planes p;
        vd z_col[TL_SMALL_BOX];
        vd z[3];
        pop_fixed(s, sink, q, i, n, &t, z);
        if (sink_has_depth(sink)) {
            p = plane_lanes(&t, z);
            for (int col = 0; col < TL_SMALL_BOX; col++) {
                z_col[col] = vd_mul(p.slope_x, p.x);
                p.x = vd_add(p.x, step);
            }
        }
        const vi sample = t.sample, size = vi_load(q->size + i);
        const vi n_cols = vi_and(size, vi_set1(0xffff)), n_rows = vi_shift_right(size, 16);
        const vm live = vm_first(n - i);
        const vi id = names_of(s->snapped, live, vi_load(q->id + i));
        for (int row = 0; row < TL_SMALL_BOX; row++) {
            const vm in_row = vm_and(live, vi_gt(n_rows, vi_set1(row)));
            vi e0 = t.e[0], e1 = t.e[1], e2 = t.e[2];
            vd z_row;
            if (sink_has_depth(sink)) {
                z_row = vd_add(p.z0, vd_mul(p.slope_y, p.y));
                p.y = vd_add(p.y, step);
            }
            for (int col = 0; col < TL_SMALL_BOX; col++) {
                const vm in_box = vm_and(in_row, vi_gt(n_cols, vi_set1(col)));
                const vm in = vm_and(in_box, vi_gt(vi_or(vi_or(e0, e1), e2), vi_set1(-1)));
                if (TL_LANES > 1 || vm_any(in))
                    n_fragments =
                        emit(&s->fragments, n_fragments, sink, in, vi_add(sample, vi_set1(row * stride + col)), id,
                             sink_has_depth(sink) ? sum_depth(z_row, z_col[col]) : vf_set1(0.0f));
                e0 = vi_sub(e0, t.dy[0]), e1 = vi_sub(e1, t.dy[1]), e2 = vi_sub(e2, t.dy[2]);
            }
            for (int k = 0; k < 3; k++)
                t.e[k] = vi_add(t.e[k], t.dx[k]);
            if ((row & 1) == 1)
                n_fragments = make_room(s, n_fragments);
        }
    }
    s->fragments.n = n_fragments;
}

TL_LIST_COPIES(flush_small_fixed, (walk_state * s), s)

/* ---- TL_FLOAT -------------------------------------------------------------------------------------------- */

/* Sets `in` to the samples inside, as float32 decides; returns the lanes in doubt at some sample, in the box or beside
 * it. */
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

/* Samples in doubt of a vector of boxes: lane | place << 8, place = row * TL_SMALL_BOX + col. */
typedef struct {
    int n;
    int32_t codes[(TL_SMALL_BOX * TL_SMALL_BOX + 1) * TL_MAX_LANES];
} doubted_samples;

/* Decides samples in doubt, TL_LANES at a time by float64, then by the exact sign; sets bit `lane` of found[place] for
 * those inside. */
TL_INLINE void decide_samples(const lane_exact *t, const doubted_samples *d, unsigned *found)
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
            if (inside >> j & 1 || is_inside(p, sample, t->test))
                found[at] |= 1u << k;
        }
    }
}

/* Decides the samples in doubt: first lanes on the grid, then by float64, then by the exact sign. */
static __attribute__((noinline)) void refine_boxes(walk_state *s, lane_exact *t, vi n_cols, vi n_rows, int size,
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
            d.n += vi_compress(d.codes + d.n, near, vi_add(vi_iota(), vi_set1((row * TL_SMALL_BOX + col) << 8)));
            for (int k = 0; k < 3; k++)
                e[k] = vf_sub(e[k], t->dy[k]);
        }
        for (int k = 0; k < 3; k++)
            t->e[k] = vf_add(t->e[k], t->dx[k]);
    }
    if (!d.n)
        return;
    vi_store(d.codes + d.n, vi_set1(0));
    decide_samples(t, &d, found);
    for (int row = 0; row < size; row++)
        for (int col = 0; col < size; col++)
            in[row][col] = vm_or(in[row][col], vm_from_bits(found[row * TL_SMALL_BOX + col]));
}

/* Removes the samples of triangles without a depth plane, which are listed as slivers. */
TL_INLINE void take_out_sliver_samples(walk_state *s, lane_exact *t, int size, box_masks in)
{
    const int n = s->n_slivers;
    take_out_slivers(s, t);
    if (__builtin_expect(s->n_slivers > n, 0))
        for (int row = 0; row < size; row++)
            for (int col = 0; col < size; col++)
                in[row][col] = vm_and(in[row][col], t->live);
}

/* Finds the samples of TL_LANES boxes that have been loaded and placed, and their planes. */
TL_INLINE void find_box_samples(walk_state *s, tl_sink sink, lane_exact *t, vi n_cols, vi n_rows, int size,
                                box_masks in, lane_planes *p)
{
    setup_float(s, sink, t, 1);
    if (__builtin_expect(vm_any(test_boxes(t, n_cols, n_rows, size, in)), 0)) {
        lane_exact own = *t;
        refine_boxes(s, &own, n_cols, n_rows, size, in);
    }
    if (sink_has_depth(sink)) {
        take_out_sliver_samples(s, t, size, in);
        *p = plane_of_lanes(s, t);
    }
}

TL_INLINE void flush_small_float(walk_state *s, tl_sink sink)
{
    const box_queue *q = &s->small;
    const int32_t stride = (int32_t)s->target->stride_px;
    int n_fragments = s->fragments.n;
    for (int i = 0; i < q->n; i += TL_LANES) {
        lane_exact t;
        lane_planes p;
        box_masks in;
        vd z_col[TL_SMALL_BOX], z_row;
        const vi box = vi_load(q->size + i);
        pop_float(s, sink, q, i, q->n, &t);
        measure_points(&t);
        find_box_samples(s, sink, &t, vi_and(box, vi_set1(0xffff)), vi_shift_right(box, 16), TL_SMALL_BOX, in, &p);
        const vi id = names_of(s->snapped, t.live, t.ids);
        for (int col = 0; sink_has_depth(sink) && col < TL_SMALL_BOX; col++)
            z_col[col] = vd_mul(p.slope_x, vd_sub(vd_add(p.x, vd_set1(col)), p.x0));
        for (int row = 0; row < TL_SMALL_BOX; row++) {
            if (sink_has_depth(sink))
                z_row = vd_add(p.z0, vd_mul(p.slope_y, vd_sub(vd_add(p.y, vd_set1(row)), p.y0)));
            for (int col = 0; col < TL_SMALL_BOX; col++)
                if (TL_LANES > 1 || vm_any(in[row][col]))
                    n_fragments = emit(&s->fragments, n_fragments, sink, in[row][col],
                                       vi_add(t.sample, vi_set1(row * stride + col)), id,
                                       sink_has_depth(sink) ? sum_depth(z_row, z_col[col]) : vf_set1(0.0f));
            if ((row & 1) == 1)
                n_fragments = make_room(s, n_fragments);
        }
    }
    s->small.n = 0;
    s->fragments.n = n_fragments;
}
TL_LIST_COPIES(flush_small_float, (walk_state * s), s)

TL_INLINE void draw_tiny_float(walk_state *s, tl_sink sink, lane_batch *b, vm live, vi id)
{
    lane_exact *t = &b->t;
    lane_planes p;
    box_masks in;
    t->ids = id, t->live = live;
    place_float(s, sink, b->col, b->row, b->xy, t);
    if (sink_has_depth(sink) && b->is_placed)
        measure_places(s, b->x_fx, b->y_fx, b->col, b->row, t);
    else
        measure_points(t);
    find_box_samples(s, sink, t, b->n_cols, b->n_rows, 2, in, &p);
    emit_tiny(s, TL_FLOAT, sink, in, t->sample, names_of(s->snapped, t->live, t->ids), &p);
}

#endif
