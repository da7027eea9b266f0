/* Rows: triangles with boxes of 5 to 62 samples a side, by the ends of TL_LANES rows at a time.
 * In: the queue of batch.c.  Out: rows of samples to the sink.
 *
 * An edge ends a row at floor(v / d), v = E' at the row's first sample, d = |dy|.  It is computed in float32 as
 * floor((v + 0.5) * (1 / d)), exactly: v + 0.5 has at most 22 bits; with |v / d| < 64 the two roundings err by less
 * than 64 * 2^-22 = 2^-16, while (v + 0.5) / d is at least 0.5 / d > 2^-15 from an integer.  Farther out the clamp to
 * the box swallows the error.  Squares (batch.c): 60 pixels of 2^8 make |v| < 2^22, which float32 still holds exactly,
 * half included. */
#ifndef TL_ROWS_C
#define TL_ROWS_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "raster/alone.c"
#include "raster/batch.c"
#include "raster/covered.c"
#include "raster/hooks.h"
#include "raster/sink.c"

/* Which edge of TL_LANES triangles is the first on the left, the first on the right, and the third one, which is on
 * either side or horizontal: edge 0 or 1 by is0 and is1 of that place, else edge 2. */
typedef struct {
    vm is0[3], is1[3];
    vm third_is_left, third_is_right;
} lane_sides;

/* These edges. */
typedef struct {
    vf start[3], step[3], inverse[3]; /* left, right, third */
    vm third_is_left, third_is_right;
} lane_edges;

/* The same in memory, with the depth planes. */
typedef struct {
    float start[3][TL_MAX_LANES], step[3][TL_MAX_LANES], inverse[3][TL_MAX_LANES]; /* left, right, third */
    int32_t third_is_left[TL_MAX_LANES], third_is_right[TL_MAX_LANES];             /* 0 or -1 */
    double z0[TL_MAX_LANES], slope_x[TL_MAX_LANES], slope_y[TL_MAX_LANES], x[TL_MAX_LANES], y[TL_MAX_LANES];
} row_edges;

TL_INLINE lane_sides find_sides(const lane_triangles *t)
{
    vm left[3], right[3];
    for (int k = 0; k < 3; k++) {
        left[k] = vi_gt(vi_set1(0), t->dy[k]);
        right[k] = vi_gt(t->dy[k], vi_set1(0));
    }
    const vm third0 = vm_and_not(vm_and_not(vm_all(), left[0]), right[0]);
    const vm taken1 = vm_or(vm_and_not(left[1], left[0]), vm_and_not(right[1], right[0]));
    const vm third1 = vm_and_not(vm_and_not(vm_all(), taken1), third0);
    const vm third2 = vm_and_not(vm_and_not(vm_all(), third0), third1);
    return (lane_sides){
        {left[0], right[0], third0},
        {left[1], right[1], third1},
        vm_or(vm_and(third1, left[1]), vm_and(third2, left[2])),
        vm_or(vm_and(third1, right[1]), vm_and(third2, right[2])),
    };
}

TL_INLINE void sort_edges(const lane_triangles *t, lane_edges *r)
{
    const lane_sides sides = find_sides(t);
    vf start[3], step[3], inverse[3];
    for (int k = 0; k < 3; k++) {
        start[k] = vf_add(vf_from_vi(t->e[k]), vf_set1(0.5f));
        step[k] = vf_from_vi(t->dx[k]);
        /* a horizontal edge is never asked: 1 keeps infinities away */
        inverse[k] =
            vf_div(vf_set1(1.0f), vf_from_vi(vi_max(vi_max(t->dy[k], vi_sub(vi_set1(0), t->dy[k])), vi_set1(1))));
    }
    for (int side = 0; side < 3; side++) {
        const vm is0 = sides.is0[side], is1 = sides.is1[side];
        r->start[side] = vf_select(is0, start[0], vf_select(is1, start[1], start[2]));
        r->step[side] = vf_select(is0, step[0], vf_select(is1, step[1], step[2]));
        r->inverse[side] = vf_select(is0, inverse[0], vf_select(is1, inverse[1], inverse[2]));
    }
    r->third_is_left = sides.third_is_left;
    r->third_is_right = sides.third_is_right;
}

TL_INLINE void store_edges(const lane_edges *e, row_edges *r)
{
    const vi zero = vi_set1(0), yes = vi_set1(-1);
    for (int side = 0; side < 3; side++) {
        vf_store(r->start[side], e->start[side]);
        vf_store(r->step[side], e->step[side]);
        vf_store(r->inverse[side], e->inverse[side]);
    }
    vi_store(r->third_is_left, vi_select(e->third_is_left, yes, zero));
    vi_store(r->third_is_right, vi_select(e->third_is_right, yes, zero));
}

/* floor(v / d) for TL_LANES rows. */
TL_INLINE vi row_quotients(const row_edges *r, int side, int i, vf rows)
{
    const vf v = vf_add(vf_set1(r->start[side][i]), vf_mul(vf_set1(r->step[side][i]), rows));
    return vi_floor(vf_mul(v, vf_set1(r->inverse[side][i])));
}

/* Rows of a block of at most TL_LANES columns; the depth of a sample is the sum of its row's and its column's. */
TL_INLINE void draw_block(const tl_target *target, tl_sink sink, const int32_t *bits, const double *z_row,
                          int stride_of_rows, int64_t at, int n_rows, int is_half, vd z_col, int32_t id)
{
    const int64_t stride = target->stride_px;
    (void)is_half;
#if TL_HALF_LANES
    if (is_half && sink_has_depth(sink) && sink != TL_SINK_PEEL) {
        for (int row = 0; row < n_rows; row++, at += stride)
            put_depths_half(target, sink, at, (hm)bits[row * stride_of_rows],
                            hf_sum_depth(z_row[row * stride_of_rows], hd_lower(z_col)), hi_lower(vi_set1(id)));
        return;
    }
#endif
    for (int row = 0; row < n_rows; row++, at += stride) {
        const unsigned drawn = (unsigned)bits[row * stride_of_rows];
        const vm m = vm_from_bits(drawn);
        if (sink == TL_SINK_MASK)
            cover(target, at, drawn);
        else if (sink_has_depth(sink))
            put_depths(target, sink, at, m, sum_depth(vd_set1(z_row[row * stride_of_rows]), z_col), id);
        else
            put_numbers(target, sink, at, m, vi_set1(id));
    }
}

/* One triangle of the queue, in blocks of TL_LANES x TL_LANES samples. */
TL_INLINE void draw_rows(const batch_state *s, const tl_target *target, tl_sink sink, const row_edges *r, int i,
                         int32_t sample, int32_t size, int32_t id)
{
    const double unit2 = (double)(2 << s->window->subpixel_bits);
    const int n_cols = size & 0xffff, n_rows = size >> 16;
    const vi zero = vi_set1(0);
    const vm third_is_left = vi_gt(zero, vi_set1(r->third_is_left[i]));
    const vm third_is_right = vi_gt(zero, vi_set1(r->third_is_right[i]));
    int32_t bits[TL_MAX_LANES];
    double z_row[TL_MAX_LANES];
    const vd steps = ramp(unit2);
    for (int row0 = 0; row0 < n_rows; row0 += TL_LANES) {
        const int64_t at = (uint32_t)sample + row0 * target->stride_px;
        const vf rows = vf_from_vi(vi_add(vi_iota(), vi_set1(row0)));
        vi left = row_quotients(r, 0, i, rows), right = row_quotients(r, 1, i, rows);
        const vi third = row_quotients(r, 2, i, rows);
        /* no branch: which side the third edge is on cannot be predicted */
        left = vi_select(third_is_left, vi_min(left, third), left);
        right = vi_select(third_is_right, vi_min(right, third), right);
        const vi first = vi_sub(zero, left), end = vi_select(vm_first(n_rows - row0), vi_add(right, vi_set1(1)), zero);
        if (sink_has_depth(sink)) {
            const vd ys = vd_add(vd_set1(r->y[i] + row0 * unit2), steps);
            vd_store(z_row, vd_add(vd_set1(r->z0[i]), vd_mul(vd_set1(r->slope_y[i]), ys)));
        }
        for (int col0 = 0; col0 < n_cols; col0 += TL_LANES) {
            const int width = n_cols - col0 < TL_LANES ? n_cols - col0 : TL_LANES;
            const vi in_block = vi_bit_ranges(vi_max(vi_sub(first, vi_set1(col0)), zero),
                                              vi_max(vi_min(vi_sub(end, vi_set1(col0)), vi_set1(width)), zero));
            const unsigned drawn = vm_bits(vi_gt(in_block, zero));
            if (!drawn)
                continue;
            const int begin = __builtin_ctz(drawn), n = 32 - __builtin_clz(drawn) - begin;
            vd z_col = vd_set1(0);
            if (sink_has_depth(sink))
                z_col = vd_mul(vd_set1(r->slope_x[i]), vd_add(vd_set1(r->x[i] + col0 * unit2), steps));
            vi_store(bits, in_block);
            draw_block(target, sink, bits + begin, z_row + begin, 1, at + col0 + begin * target->stride_px, n,
                       width <= TL_HALF_LANES, z_col, id);
        }
    }
}

/* The samples from `begin` on, up to `end`, of the row of each triangle that its edges are at; goes on to the next
 * row. */
TL_INLINE void next_row(lane_edges *e, vi n_cols, vi *begin, vi *end)
{
    const vi zero = vi_set1(0), one = vi_set1(1);
    vi quotient[3];
    for (int side = 0; side < 3; side++) {
        quotient[side] = vi_floor(vf_mul(e->start[side], e->inverse[side]));
        e->start[side] = vf_add(e->start[side], e->step[side]);
    }
    const vi left = vi_select(e->third_is_left, vi_min(quotient[0], quotient[2]), quotient[0]);
    const vi right = vi_select(e->third_is_right, vi_min(quotient[1], quotient[2]), quotient[1]);
    *begin = vi_max(vi_sub(zero, left), zero), *end = vi_min(vi_add(right, one), n_cols);
}

/* The rows of TL_LANES triangles: of each its covered samples, a bit each, and its depth at column 0.  Column k adds
 * slope_x * ((x + k * step) - x0). */
typedef struct {
    int32_t bits[TL_MIDDLE_BOX][TL_MAX_LANES];
    double z[TL_MIDDLE_BOX][TL_MAX_LANES];
    int32_t sample[TL_MAX_LANES];
    double slope_x[TL_MAX_LANES], x[TL_MAX_LANES], x0[TL_MAX_LANES], step;
} middle_rows;

TL_INLINE void setup_middle(tl_sink sink, const lane_triangles *t, const lane_planes *p, vi n_cols, int n_rows,
                            double unit2, middle_rows *m)
{
    const vi zero = vi_set1(0);
    const vd step = vd_set1(unit2);
    lane_edges e;
    sort_edges(t, &e);
    vd y;
    if (sink_has_depth(sink))
        y = p->y;
    for (int row = 0; row < n_rows; row++) {
        vi begin, end;
        next_row(&e, n_cols, &begin, &end);
        vi_store(m->bits[row], vi_bit_ranges(begin, vi_max(end, zero)));
        if (sink_has_depth(sink)) {
            vd_store(m->z[row], vd_add(p->z0, vd_mul(p->slope_y, y)));
            y = vd_add(y, step);
        }
    }
}

/* Draws the triangles in `live` of those at i in a queue. */
TL_INLINE void draw_middle(const tl_snapped *snapped, const tl_target *shared, const box_queue *q, int i, unsigned live,
                           const middle_rows *m, tl_sink sink)
{
    const tl_target target = *shared; /* a copy that no store can change */
    for (; live; live &= live - 1) {
        const int k = __builtin_ctz(live);
        const int32_t size = q->size[i + k];
        vd z_cols = vd_set1(0);
        if (sink_has_depth(sink)) {
            const vd x = vd_sub(vd_add(vd_set1(m->x[k]), ramp(m->step)), vd_set1(m->x0[k]));
            z_cols = vd_mul(vd_set1(m->slope_x[k]), x);
        }
        draw_block(&target, sink, &m->bits[0][k], &m->z[0][k], TL_MAX_LANES, (uint32_t)m->sample[k], size >> 16,
                   (size & 0xffff) <= TL_HALF_LANES, z_cols, name_of(snapped, q->id[i + k]));
    }
}

TL_SINK_COPIES(draw_middle,
               (const tl_snapped *snapped, const tl_target *shared, const box_queue *q, int i, unsigned live,
                const middle_rows *m),
               snapped, shared, q, i, live, m)

TL_INLINE void flush_middle(batch_state *s, tl_sink sink)
{
    const double unit2 = (double)(2 << s->window->subpixel_bits);
    box_queue *q = &s->middle;
    const int n = q->n;
    q->n = 0;
    for (int i = 0; i < n; i += TL_LANES) {
        lane_triangles t;
        lane_planes p;
        middle_rows m;
        vd z[3];
        const int end = n - i < TL_LANES ? n - i : TL_LANES;
        int max_rows = 0;
        pop(s, sink, q, i, n, &t, z);
        vi_store(m.sample, t.sample);
        if (sink_has_depth(sink)) {
            p = plane_lanes(&t, z);
            vd_store(m.slope_x, p.slope_x), vd_store(m.x, p.x), vd_store(m.x0, vd_set1(0.0));
            m.step = unit2;
        }
        for (int k = 0; k < end; k++)
            max_rows = q->size[i + k] >> 16 > max_rows ? q->size[i + k] >> 16 : max_rows;
        setup_middle(sink, &t, &p, vi_and(vi_load(q->size + i), vi_set1(0xffff)), max_rows, unit2, &m);
        TL_SINK_CALL(draw_middle, s->target->sink, s->snapped, s->target, q, i, (1u << end) - 1, &m)
    }
}

TL_LIST_COPIES(flush_middle, (batch_state *s), s)

/* Draws n triangles at i in a queue. */
TL_INLINE void draw_all_rows(const batch_state *s, const row_edges *r, const int32_t *sample, int i, int n,
                             tl_sink sink)
{
    const tl_target target = *s->target; /* a copy that no store can change */
    const box_queue *q = &s->rows;
    for (int k = 0; k < n; k++)
        draw_rows(s, &target, sink, r, k, sample[k], q->size[i + k], name_of(s->snapped, q->id[i + k]));
}

TL_SINK_COPIES(draw_all_rows, (const batch_state *s, const row_edges *r, const int32_t *sample, int i, int n), s, r,
               sample, i, n)

TL_INLINE void flush_rows(batch_state *s, tl_sink sink)
{
    box_queue *q = &s->rows;
    const int n = q->n;
    q->n = 0;
    for (int i = 0; i < n; i += TL_LANES) {
        lane_triangles t;
        row_edges r;
        vd z[3];
        int32_t sample[TL_MAX_LANES];
        pop(s, sink, q, i, n, &t, z);
        lane_edges edges;
        sort_edges(&t, &edges);
        store_edges(&edges, &r);
        vi_store(sample, t.sample);
        if (sink_has_depth(sink)) {
            const lane_planes p = plane_lanes(&t, z);
            vd_store(r.z0, p.z0);
            vd_store(r.slope_x, p.slope_x);
            vd_store(r.slope_y, p.slope_y);
            vd_store(r.x, p.x);
            vd_store(r.y, p.y);
        }
        const int end = n - i < TL_LANES ? n - i : TL_LANES;
        TL_SINK_CALL(draw_all_rows, s->target->sink, s, &r, sample, i, end)
    }
}

TL_LIST_COPIES(flush_rows, (batch_state *s), s)

#endif
