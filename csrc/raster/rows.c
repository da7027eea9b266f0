/* Rows: triangles with boxes of 5 to 62 samples a side, by the ends of TL_LANES rows at a time.
 * In: queues of boxes.  Out: rows of samples to the sink.
 *
 * row_edges.h explains how an edge ends a row, and why the row end is exact or in doubt. */
#ifndef TL_ROWS_C
#define TL_ROWS_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "sink/covered.c"
#include "sink/sink.c"
#include "raster/single_fixed.c"
#include "raster/refine.c"
#include "raster/row_edges.h"
#include "raster/state.h"
#include "raster/triangles_fixed.c"
#include "raster/triangles_float.c"

/* TL_LANES triangles of a queue. */
typedef struct {
    lane_edges edges;
    lane_planes planes; /* only if the sink has depth */
    vi sample;          /* the first sample: row * stride_px + column */
    unsigned live;
} row_lanes;

/* TL_LANES triangles of a queue, in memory. */
typedef struct {
    float start[3][TL_MAX_LANES], step[3][TL_MAX_LANES], inverse[3][TL_MAX_LANES]; /* left, right, third */
    int32_t third_is_left[TL_MAX_LANES], third_is_right[TL_MAX_LANES];             /* 0 or -1 */
    double z0[TL_MAX_LANES], slope_x[TL_MAX_LANES], slope_y[TL_MAX_LANES], x[TL_MAX_LANES], y[TL_MAX_LANES];
    int32_t sample[TL_MAX_LANES];
    float band[3][TL_MAX_LANES];
    double x0[TL_MAX_LANES], y0[TL_MAX_LANES];
} row_edges;

/* ---- edges ----------------------------------------------------------------------------------------------- */

TL_INLINE void sort_float_edges(const walk_state *s, const lane_exact *t, float far, lane_edges *r)
{
    const vf zero = vf_set1(0.0f);
    vf inverse[3], band[3];
    vm left[3], right[3];
    set_bands(s, t, far, inverse, band);
    for (int k = 0; k < 3; k++)
        left[k] = vf_lt(t->dy[k], zero), right[k] = vf_lt(zero, t->dy[k]);
    const lane_sides sides = sides_of(left, right);
    sort_edges(TL_FLOAT, &sides, t->e, t->dx, inverse, band, r);
}

/* Loads the triangles [i, i + TL_LANES) of a queue of n; `far` is the band for row ends up to 17 or up to 62 columns
 * away. t: TL_FLOAT only, for refinement. */
TL_INLINE void load_rows(walk_state *s, tl_geometry g, tl_sink sink, const box_queue *q, int i, int n, float far,
                         lane_exact *t, row_lanes *r)
{
    if (g == TL_FIXED) {
        lane_triangles own;
        vd z[3];
        pop_fixed(s, sink, q, i, n, &own, z);
        sort_fixed_edges(own.e, own.dx, own.dy, &r->edges);
        r->sample = own.sample, r->live = (1u << lanes_at(i, n)) - 1;
        if (sink_has_depth(sink))
            r->planes = plane_lanes(&own, z);
        return;
    }
    pop_float(s, sink, q, i, n, t);
    setup_float(s, sink, t, 0);
    sort_float_edges(s, t, far, &r->edges);
    r->sample = t->sample, r->live = vm_bits(t->live);
    if (sink_has_depth(sink))
        r->planes = plane_of_lanes(s, t);
}

TL_INLINE void store_edges(tl_geometry g, tl_sink sink, const row_lanes *lanes, row_edges *r)
{
    const vi zero = vi_set1(0), yes = vi_set1(-1);
    const lane_edges *e = &lanes->edges;
    const lane_planes *p = &lanes->planes;
    for (int side = 0; side < 3; side++) {
        vf_store(r->start[side], e->start[side]);
        vf_store(r->step[side], e->step[side]);
        vf_store(r->inverse[side], e->inverse[side]);
        if (g == TL_FLOAT)
            vf_store(r->band[side], e->band[side]);
    }
    vi_store(r->third_is_left, vi_select(e->third_is_left, yes, zero));
    vi_store(r->third_is_right, vi_select(e->third_is_right, yes, zero));
    vi_store(r->sample, lanes->sample);
    if (!sink_has_depth(sink))
        return;
    vd_store(r->z0, p->z0), vd_store(r->slope_x, p->slope_x), vd_store(r->slope_y, p->slope_y);
    vd_store(r->x, p->x), vd_store(r->y, p->y);
    if (g == TL_FLOAT)
        vd_store(r->x0, p->x0), vd_store(r->y0, p->y0);
}

/* ---- row ends -------------------------------------------------------------------------------------------- */

/* The ends of TL_LANES rows of triangle k, from row0 on. */
TL_INLINE void find_rows_of_one(tl_geometry g, const row_edges *r, int k, vm third_is_left, vm third_is_right, int row0,
                                int n_cols, vi *first, vi *end, vm *doubted)
{
    const vi zero = vi_set1(0), one = vi_set1(1);
    const vf rows = vf_from_vi(vi_add(vi_iota(), vi_set1(row0)));
    vi quotient[3], left, right;
    for (int side = 0; side < 3; side++) {
        const vf start = vf_set1(r->start[side][k]), step = vf_set1(r->step[side][k]);
        const vf v = g == TL_FIXED ? vf_add(start, vf_mul(step, rows)) : vf_fma(step, rows, start);
        const vf q = vf_mul(v, vf_set1(r->inverse[side][k]));
        quotient[side] = vi_floor(q);
        if (g == TL_FLOAT)
            *doubted = vm_or(*doubted, is_near_integer(q, vf_set1(r->band[side][k])));
    }
    meet_third(quotient, third_is_left, third_is_right, &left, &right);
    *first = vi_sub(zero, left), *end = vi_add(right, one);
    if (g == TL_FLOAT) /* quotients of level edges are unbounded */
        *first = vi_max(*first, zero), *end = vi_min(*end, vi_set1(n_cols));
}

/* ---- boxes of up to 16 rows and 16 or 31 columns --------------------------------------------------------- */

TL_INLINE void put_lanes(const tl_target *target, tl_sink sink, int64_t at, vm m, vd z_row, vd z_col, int32_t id)
{
    if (sink_has_depth(sink))
        put_depths(target, sink, at, m, sum_depth(z_row, z_col), id);
    else
        put_numbers(target, sink, at, m, vi_set1(stored_value(target, sink, id)));
}

/* Draws rows of a block of at most TL_BLOCK_COLS columns, in a mask TL_BIT_COLS; the depth of a sample is the sum of
 * its row's and its column's depth. */
TL_INLINE void draw_block(const tl_target *target, tl_sink sink, const int32_t *bits, const double *z_row,
                          int stride_of_rows, int64_t at, int n_rows, const double *z_cols, int32_t id)
{
    const int64_t stride = target->stride_px;
    const vd z_col = vd_load(z_cols);
    for (int row = 0; row < n_rows; row++, at += stride) {
        unsigned drawn = (unsigned)bits[row * stride_of_rows];
        if (sink == TL_SINK_MASK) {
            cover(target, at, drawn);
            continue;
        }
        if (TL_BLOCK_COLS == TL_LANES) {
            const vd z = vd_set1(sink_has_depth(sink) ? z_row[row * stride_of_rows] : 0.0);
            put_lanes(target, sink, at, vm_from_bits(drawn), z, z_col, id);
            continue;
        }
        for (int col = 0; drawn; drawn >>= TL_LANES, col += TL_LANES) {
            const int skipped = __builtin_ctz(drawn);
            const vd z = vd_set1(sink_has_depth(sink) ? z_row[row * stride_of_rows] : 0.0);
            col += skipped, drawn >>= skipped;
            put_lanes(target, sink, at + col, vm_from_bits(drawn), z, vd_load(z_cols + col), id);
        }
    }
}

/* The rows of TL_LANES triangles: a bit for each covered sample, and the depth at column 0.  Column k adds slope_x *
 * ((x + k * step) - x0). */
typedef struct {
    int32_t bits[TL_MIDDLE_BOX][TL_MAX_LANES];
    double z[TL_MIDDLE_BOX][TL_MAX_LANES];
    int32_t sample[TL_MAX_LANES];
    double slope_x[TL_MAX_LANES], x[TL_MAX_LANES], x0[TL_MAX_LANES], step;
} middle_rows;

/* Draws triangles i + k of a queue, for the lanes k in `live`. */
TL_INLINE void draw_middle(const tl_snapped *snapped, const tl_target *shared, const box_queue *q, int i, unsigned live,
                           const middle_rows *m, tl_sink sink)
{
    const tl_target target = *shared; /* a copy that no store can alias */
    for (; live; live &= live - 1) {
        const int k = __builtin_ctz(live);
        const int32_t size = q->size[i + k];
        double z_cols[TL_BLOCK_COLS + TL_LANES];
        for (int col = 0; sink_has_depth(sink) && col < (TL_BLOCK_COLS == TL_LANES ? 1 : size & 0xffff);
             col += TL_LANES) {
            const vd x = vd_sub(vd_add(vd_set1(m->x[k] + col * m->step), ramp(m->step)), vd_set1(m->x0[k]));
            vd_store(z_cols + col, vd_mul(vd_set1(m->slope_x[k]), x));
        }
        draw_block(&target, sink, &m->bits[0][k], &m->z[0][k], TL_MAX_LANES, (uint32_t)m->sample[k], size >> 16, z_cols,
                   name_of(snapped, q->id[i + k]));
    }
}

TL_SINK_COPIES(draw_middle,
               (const tl_snapped *snapped, const tl_target *shared, const box_queue *q, int i, unsigned live,
                const middle_rows *m),
               snapped, shared, q, i, live, m)

/* Sets the rows of TL_LANES triangles; returns the lanes with a row end in doubt. */
TL_INLINE vm find_middle_rows(tl_geometry g, tl_sink sink, row_lanes *r, vi n_cols, int n_rows, double step,
                              middle_rows *m)
{
    const vi zero = vi_set1(0);
    const lane_planes *p = &r->planes;
    vm doubted = vm_first(0);
    vi_store(m->sample, r->sample);
    if (sink_has_depth(sink)) {
        vd_store(m->slope_x, p->slope_x), vd_store(m->x, p->x), vd_store(m->x0, p->x0);
        m->step = step;
        vd y = p->y;
        for (int row = 0; row < n_rows; row++, y = vd_add(y, vd_set1(step)))
            vd_store(m->z[row], vd_add(p->z0, vd_mul(p->slope_y, g == TL_FIXED ? y : vd_sub(y, p->y0))));
    }
    for (int row = 0; row < n_rows; row++) {
        vi begin, end;
        next_row(g, &r->edges, n_cols, &begin, &end, &doubted);
        vi_store(m->bits[row], vi_bit_ranges(begin, vi_max(end, zero)));
    }
    return doubted;
}

TL_INLINE void flush_middle(walk_state *s, tl_geometry g, tl_sink sink)
{
    box_queue *q = &s->middle;
    const double step = plane_step(s, g);
    const int n = q->n;
    q->n = 0;
    for (int i = 0; i < n; i += TL_LANES) {
        lane_exact t;
        row_lanes r;
        middle_rows m;
        load_rows(s, g, sink, q, i, n, TL_NEAR_BAND, &t, &r);
        const int max_rows = most_rows(q, i, n);
        const vi n_cols = vi_and(vi_load(q->size + i), vi_set1(0xffff));
        const vm doubted = find_middle_rows(g, sink, &r, n_cols, max_rows, step, &m);
        if (g == TL_FLOAT && __builtin_expect(vm_bits(doubted) & r.live, 0))
            refine_middle_rows(s, q, i, &t, vm_and(doubted, t.live), max_rows, m.bits);
        TL_SINK_CALL(draw_middle, s->target->sink, s->snapped, s->target, q, i, r.live, &m)
    }
}
TL_WALK_COPIES(flush_middle)

/* ---- boxes of up to 62 x 62 samples ---------------------------------------------------------------------- */

/* The depths of columns from col0 on, to be added to those of rows. */
TL_INLINE vd depths_of_columns(tl_geometry g, const row_edges *r, int64_t k, int col0, double unit)
{
    const vd x = vd_add(vd_set1(r->x[k] + col0 * unit), ramp(unit));
    return vd_mul(vd_set1(r->slope_x[k]), g == TL_FIXED ? x : vd_sub(x, vd_set1(r->x0[k])));
}

/* Draws the samples [first, end) of up to TL_LANES rows, a row at a time: each has as few vectors as it needs.  Blocks
 * of rows and columns have more vectors and fewer mispredicted branches; Zen 4: labels of 20,000 triangles of 40 px
 * take 0.77 of their time with AVX2, 0.96 with AVX-512; ids and depth of a mesh of 100,000 with AVX-512 1.07. */
TL_INLINE void draw_spans(const tl_target *target, tl_sink sink, vi first, vi end, int n_rows, const double *z_row,
                          int64_t at, const double *z_cols, int32_t id)
{
    int32_t firsts[TL_MAX_LANES], ends[TL_MAX_LANES];
    vi_store(firsts, first), vi_store(ends, end);
    for (int row = 0; row < n_rows; row++, at += target->stride_px) {
        const int from = firsts[row], to = ends[row];
        if (sink == TL_SINK_MASK) {
            if (from < to)
                cover(target, at + from, ~0ull >> (64 - (to - from)));
            continue;
        }
        const vd z = vd_set1(sink_has_depth(sink) ? z_row[row] : 0.0);
        for (int col = from; col < to; col += TL_LANES)
            put_lanes(target, sink, at + col, vi_gt(vi_set1(to - col), vi_iota()), z, vd_load(z_cols + col), id);
    }
}

/* Draws triangle i + k of the queue, TL_LANES rows at a time.  With an int for k, gcc spills one more register in the
 * copy for masks: 3 % of its time on AVX-512. */
TL_INLINE void draw_rows(walk_state *s, tl_geometry g, const tl_target *target, tl_sink sink, const row_edges *r,
                         const lane_exact *t, int i, int64_t k)
{
    const double unit = plane_step(s, g);
    const box_queue *q = &s->rows;
    const int32_t size = q->size[i + k], id = name_of(s->snapped, q->id[i + k]), sample = r->sample[k];
    const int n_cols = size & 0xffff, n_rows = size >> 16;
    const vi zero = vi_set1(0);
    const vm third_is_left = vi_gt(zero, vi_set1(r->third_is_left[k]));
    const vm third_is_right = vi_gt(zero, vi_set1(r->third_is_right[k]));
    double z_row[TL_MAX_LANES], z_cols[TL_MAX_BOX_PX + TL_MAX_LANES];
    for (int col = 0; sink_has_depth(sink) && col < n_cols; col += TL_LANES)
        vd_store(z_cols + col, depths_of_columns(g, r, k, col, unit));
    for (int row0 = 0; row0 < n_rows; row0 += TL_LANES) {
        const int64_t at = (uint32_t)sample + row0 * target->stride_px;
        vm doubted = vm_first(0);
        vi first, end;
        find_rows_of_one(g, r, k, third_is_left, third_is_right, row0, n_cols, &first, &end, &doubted);
        doubted = vm_and(doubted, vm_first(n_rows - row0));
        if (g == TL_FLOAT && __builtin_expect(vm_any(doubted), 0)) {
            row_ends ends;
            refine_row_ends(s, i, (int)k, t, row0, vm_bits(doubted), &ends);
            first = vi_load(ends.first), end = vi_load(ends.end);
        }
        if (sink_has_depth(sink)) {
            const vd y = vd_add(vd_set1(r->y[k] + row0 * unit), ramp(unit));
            const vd from = g == TL_FIXED ? y : vd_sub(y, vd_set1(r->y0[k]));
            vd_store(z_row, vd_add(vd_set1(r->z0[k]), vd_mul(vd_set1(r->slope_y[k]), from)));
        }
        const int n = n_rows - row0 < TL_LANES ? n_rows - row0 : TL_LANES;
        draw_spans(target, sink, vi_max(first, zero), vi_min(end, vi_set1(n_cols)), n, z_row, at, z_cols, id);
    }
}

/* Draws triangles i + k of the queue, for the lanes k in `live`; TL_FIXED: the first n. */
TL_INLINE void draw_all_rows(walk_state *s, tl_geometry g, const row_edges *r, const lane_exact *t, int i, int n,
                             unsigned live, tl_sink sink)
{
    const tl_target target = *s->target; /* a copy that no store can alias */
    for (int64_t k = 0; k < n; k++)
        if (g == TL_FIXED || live >> k & 1)
            draw_rows(s, g, &target, sink, r, t, i, k);
}

TL_INLINE void draw_rows_fixed(walk_state *s, const row_edges *r, int i, int n, tl_sink sink)
{
    draw_all_rows(s, TL_FIXED, r, NULL, i, n, 0, sink);
}
TL_SINK_COPIES(draw_rows_fixed, (walk_state * s, const row_edges *r, int i, int n), s, r, i, n)

TL_INLINE void draw_rows_float(walk_state *s, const row_edges *r, const lane_exact *t, int i, unsigned live,
                               tl_sink sink)
{
    draw_all_rows(s, TL_FLOAT, r, t, i, TL_LANES, live, sink);
}
TL_SINK_COPIES(draw_rows_float, (walk_state * s, const row_edges *r, const lane_exact *t, int i, unsigned live), s, r,
               t, i, live)

TL_INLINE void flush_rows(walk_state *s, tl_geometry g, tl_sink sink)
{
    box_queue *q = &s->rows;
    const int n = q->n;
    q->n = 0;
    for (int i = 0; i < n; i += TL_LANES) {
        lane_exact t;
        row_lanes lanes;
        row_edges r;
        load_rows(s, g, sink, q, i, n, TL_FAR_BAND, &t, &lanes);
        store_edges(g, sink, &lanes, &r);
        if (g == TL_FIXED) {
            TL_SINK_CALL(draw_rows_fixed, s->target->sink, s, &r, i, lanes_at(i, n))
            continue;
        }
        s->has_refined = 0;
        TL_SINK_CALL(draw_rows_float, s->target->sink, s, &r, &t, i, lanes.live)
        if (s->has_refined)
            try_grid(s, &t, 0);
    }
}
TL_WALK_COPIES(flush_rows)

#endif
