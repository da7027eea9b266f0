/* Rows: triangles with boxes of 5 to 62 samples a side, by the ends of TL_LANES rows at a time.
 * In: the queue of batch.c.  Out: rows of samples to the sink.
 *
 * An edge ends a row at floor(v / d), v = E' at the row's first sample, d = |dy|.  It is computed in float32 as
 * floor((v + 0.5) * (1 / d)), exactly: v + 0.5 has at most 22 bits; with |v / d| < 64 the two roundings err by less than
 * 64 * 2^-22 = 2^-16, while (v + 0.5) / d is at least 0.5 / d > 2^-15 from an integer.  Farther out the clamp to the box
 * swallows the error. */
#include "fixed.h"
#include "lanes.h"

/* The left and right edge of TL_LANES triangles, and the third one, which is on either side or horizontal. */
typedef struct {
    float start[3][TL_MAX_LANES], step[3][TL_MAX_LANES], inverse[3][TL_MAX_LANES]; /* left, right, third */
    int32_t third_is_left[TL_MAX_LANES], third_is_right[TL_MAX_LANES];             /* 0 or -1 */
    double z0[TL_MAX_LANES], slope_x[TL_MAX_LANES], slope_y[TL_MAX_LANES], x[TL_MAX_LANES], y[TL_MAX_LANES];
} row_edges;

TL_INLINE void sort_edges(const lane_triangles *t, row_edges *r)
{
    const vi zero = vi_set1(0);
    vm left[3], right[3];
    vf start[3], step[3], inverse[3];
    for (int k = 0; k < 3; k++) {
        left[k] = vi_gt(zero, t->dy[k]);
        right[k] = vi_gt(t->dy[k], zero);
        start[k] = vf_add(vf_from_vi(t->e[k]), vf_set1(0.5f));
        step[k] = vf_from_vi(t->dx[k]);
        /* a horizontal edge is never asked: 1 keeps infinities away */
        inverse[k] = vf_div(vf_set1(1.0f), vf_from_vi(vi_max(vi_max(t->dy[k], vi_sub(zero, t->dy[k])), vi_set1(1))));
    }
    /* the first left edge, the first right edge, and what remains */
    const vm third0 = vm_and_not(vm_and_not(vm_all(), left[0]), right[0]);
    const vm taken1 = vm_or(vm_and_not(left[1], left[0]), vm_and_not(right[1], right[0]));
    const vm third1 = vm_and_not(vm_and_not(vm_all(), taken1), third0);
    const vm by_side[3][2] = {{left[0], left[1]}, {right[0], right[1]}, {third0, third1}};
    for (int side = 0; side < 3; side++) {
        const vm is0 = by_side[side][0], is1 = by_side[side][1];
        vf_store(r->start[side], vf_select(is0, start[0], vf_select(is1, start[1], start[2])));
        vf_store(r->step[side], vf_select(is0, step[0], vf_select(is1, step[1], step[2])));
        vf_store(r->inverse[side], vf_select(is0, inverse[0], vf_select(is1, inverse[1], inverse[2])));
    }
    const vm third2 = vm_and_not(vm_and_not(vm_all(), third0), third1);
    const vi yes = vi_set1(-1);
    vi_store(r->third_is_left, vi_select(vm_or(vm_and(third1, left[1]), vm_and(third2, left[2])), yes, zero));
    vi_store(r->third_is_right, vi_select(vm_or(vm_and(third1, right[1]), vm_and(third2, right[2])), yes, zero));
}

/* floor(v / d) for TL_LANES rows. */
TL_INLINE vi row_quotients(const row_edges *r, int side, int i, vf rows)
{
    const vf v = vf_add(vf_set1(r->start[side][i]), vf_mul(vf_set1(r->step[side][i]), rows));
    return vi_floor(vf_mul(v, vf_set1(r->inverse[side][i])));
}

/* One triangle of the queue. */
TL_INLINE void draw_rows(batch_state *s, tl_sink sink, const row_edges *r, int i, int32_t sample, int32_t size, int32_t id)
{
    const tl_target own = *s->target, *target = &own; /* a copy that no store can change */
    const double unit2 = (double)(2 << s->window->subpixel_bits);
    const int n_cols = size & 0xffff, n_rows = size >> 16;
    const int64_t stride = target->stride_px;
    const vi zero = vi_set1(0), ids = vi_set1(id);
    const vm third_is_left = vi_gt(zero, vi_set1(r->third_is_left[i]));
    const vm third_is_right = vi_gt(zero, vi_set1(r->third_is_right[i]));
    int32_t first[TL_MAX_LANES], end[TL_MAX_LANES];
    vm_ranges ranges;
    double z_row[TL_MAX_LANES];
    vd slope_x, xs, z_cols;
    if (sink_has_depth(sink)) {
        slope_x = vd_set1(r->slope_x[i]);
        xs = vd_add(vd_set1(r->x[i]), ramp(unit2));
        z_cols = vd_mul(slope_x, xs);
    }
    int64_t at = (uint32_t)sample;
    for (int row0 = 0; row0 < n_rows; row0 += TL_LANES) {
        const vf rows = vf_from_vi(vi_add(vi_iota(), vi_set1(row0)));
        vi left = row_quotients(r, 0, i, rows), right = row_quotients(r, 1, i, rows);
        const vi third = row_quotients(r, 2, i, rows);
        /* no branch: which side the third edge is on cannot be predicted */
        left = vi_select(third_is_left, vi_min(left, third), left);
        right = vi_select(third_is_right, vi_min(right, third), right);
        const vi begins = vi_max(vi_sub(zero, left), zero), ends = vi_min(vi_add(right, vi_set1(1)), vi_set1(n_cols));
        if (sink_has_depth(sink)) {
            const vd ys = vd_add(vd_set1(r->y[i] + row0 * unit2), ramp(unit2));
            vd_store(z_row, vd_add(vd_set1(r->z0[i]), vd_mul(vd_set1(r->slope_y[i]), ys)));
        }
        const int n = n_rows - row0 < TL_LANES ? n_rows - row0 : TL_LANES;
#if TL_HALF_LANES
        if (sink_has_depth(sink) && n_cols <= TL_HALF_LANES) {
            set_ranges(&ranges, begins, vi_max(ends, zero));
            for (int k = 0; k < n; k++, at += stride)
                put_depths_half(target, sink, at, (hm)get_range(&ranges, k), hf_sum_depth(z_row[k], hd_lower(z_cols)), hi_lower(ids));
            continue;
        }
#endif
        if (sink_has_depth(sink) && n_cols <= TL_LANES) {
            set_ranges(&ranges, begins, vi_max(ends, zero));
            for (int k = 0; k < n; k++, at += stride) {
                put_depths(target, sink, at, get_range(&ranges, k), sum_depth(vd_set1(z_row[k]), z_cols), ids);
            }
            continue;
        }
        vi_store(first, begins);
        vi_store(end, ends);
        for (int k = 0; k < n; k++, at += stride) {
            if (!sink_has_depth(sink)) {
                if (first[k] < end[k])
                    put_plain(target, sink, at + first[k], end[k] - first[k], id);
            } else {
                for (int col = first[k]; col < end[k]; col += TL_LANES) {
                    const vd x = vd_add(xs, vd_set1(col * unit2));
                    const vf z = sum_depth(vd_set1(z_row[k]), vd_mul(slope_x, x));
                    put_depths(target, sink, at + col, vm_first(end[k] - col), z, ids);
                }
            }
        }
    }
}

/* One triangle of any size, by the ends of TL_LANES rows at a time in float64: as above, exact while |2E| < 2^51, for then
 * |v / d| * 2^-52 < 0.5 / d. */
TL_INLINE int rows_fit(const tl_triangle *t)
{
    const double width = (double)(max3(t->x_fx[0], t->x_fx[1], t->x_fx[2]) - min3(t->x_fx[0], t->x_fx[1], t->x_fx[2]));
    const double height = (double)(max3(t->y_fx[0], t->y_fx[1], t->y_fx[2]) - min3(t->y_fx[0], t->y_fx[1], t->y_fx[2]));
    return TL_LANES > 1 && t->is_narrow && 2.0 * width * height < 0x1p50;
}

TL_INLINE void walk_rows(const tl_triangle *t, const tl_window *window, const tl_target *shared, tl_sink sink)
{
    const tl_target own = *shared, *target = &own; /* a copy that no store can change */
    const edges_64 e = setup_edges_64(t, window);
    const vd lanes = vd_from_vi(vi_iota()), one = vd_set1(1.0), zero = vd_set1(0.0), width = vd_set1((double)(t->col1 - t->col0));
    const double step = (double)((int64_t)2 << window->subpixel_bits), x0 = sample_x(t, window, t->col0);
    const vd xs = vd_add(vd_set1(x0), ramp(step)), slope_x = vd_set1(t->slope_x);
    int32_t first[TL_MAX_LANES], end[TL_MAX_LANES];
    double z_row[TL_MAX_LANES];
    for (int64_t row0 = t->row0; row0 < t->row1; row0 += TL_LANES) {
        const vd rows = vd_add(vd_set1((double)(row0 - t->row0)), lanes);
        vd begins = zero, ends = width;
        for (int k = 0; k < 3; k++) {
            if (e.dy[k] == 0)
                continue;
            const vd v = vd_add(vd_set1((double)e.value[k] + 0.5), vd_mul(vd_set1((double)e.dx[k]), rows));
            const vd quotient = vd_floor(vd_mul(v, vd_set1(1.0 / fabs((double)e.dy[k]))));
            if (e.dy[k] < 0)
                begins = vd_max(begins, vd_sub(zero, quotient));
            else
                ends = vd_min(ends, vd_add(quotient, one));
        }
        vi_store(first, vi_round(vd_min(begins, width)));
        vi_store(end, vi_round(vd_max(ends, zero)));
        if (sink_has_depth(sink)) {
            const vd ys = vd_add(vd_set1(sample_y(t, window, row0)), ramp(step));
            vd_store(z_row, vd_add(vd_set1(t->z[0]), vd_mul(vd_set1(t->slope_y), ys)));
        }
        const int n = t->row1 - row0 < TL_LANES ? (int)(t->row1 - row0) : TL_LANES;
        for (int k = 0; k < n; k++) {
            const int64_t at = (row0 + k) * target->stride_px + t->col0;
            if (!sink_has_depth(sink)) {
                if (first[k] < end[k])
                    put_plain(target, sink, at + first[k], end[k] - first[k], t->id);
                continue;
            }
            const vd z = vd_set1(z_row[k]);
            for (int32_t col = first[k]; col < end[k]; col += TL_LANES) {
                const vd x = vd_add(xs, vd_set1(col * step));
                put_depths(target, sink, at + col, vm_first(end[k] - col), sum_depth(z, vd_mul(slope_x, x)), vi_set1(t->id));
            }
        }
    }
}

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
        sort_edges(&t, &r);
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
        for (int k = 0; k < end; k++)
            draw_rows(s, sink, &r, k, sample[k], q->size[i + k], q->id[i + k]);
    }
}

TL_SINK_COPIES(flush_rows, (batch_state *s), s)
