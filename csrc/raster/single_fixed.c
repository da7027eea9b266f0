/* Single: one triangle by itself, of any size, range and method: setup and a walker to the sink.
 * In: vertex records, the pieces of clipped triangles.  Out: samples to the sink. */
#ifndef TL_SINGLE_FIXED_C
#define TL_SINGLE_FIXED_C

#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/clip.c"
#include "vertex/fixed.h"
#include "vertex/setup.c"
#include "sink/census.c"
#include "sink/sink.c"

#define TL_INT int64_t
#define TL_OP(name) i64_##name
#define TL_WALK(name) name##_64
#include "raster/walk.h"

#define TL_INT tl_int128
#define TL_OP(name) i128_##name
#define TL_WALK(name) name##_128
#include "raster/walk.h"

/* Whether float64 row ends are exact, as in row_edges.h: while |2E| < 2^51, because |v / d| * 2^-52 < 0.5 / d. */
TL_INLINE int rows_fit(const tl_triangle *t, const tl_window *window, int with_border)
{
    const double around = with_border ? (double)((int64_t)2 << window->subpixel_bits) : 0.0;
    const double width = (double)(max3(t->x_fx[0], t->x_fx[1], t->x_fx[2]) - min3(t->x_fx[0], t->x_fx[1], t->x_fx[2]));
    const double height = (double)(max3(t->y_fx[0], t->y_fx[1], t->y_fx[2]) - min3(t->y_fx[0], t->y_fx[1], t->y_fx[2]));
    return TL_LANES > 1 && t->is_narrow && 2.0 * (width + around) * (height + around) < 0x1p50;
}

/* Sets the columns [first, end) of TL_LANES rows, within [low, high]. */
TL_INLINE void find_row_ends(const edges_64 *e, vd rows, double low, double high, int32_t *first, int32_t *end)
{
    vd begins = vd_set1(low), ends = vd_set1(high);
    for (int k = 0; k < 3; k++) {
        if (e->dy[k] == 0)
            continue;
        const vd v = vd_add(vd_set1((double)e->value[k] + 0.5), vd_mul(vd_set1((double)e->dx[k]), rows));
        const vd quotient = vd_floor(vd_mul(v, vd_set1(1.0 / fabs((double)e->dy[k]))));
        if (e->dy[k] < 0)
            begins = vd_max(begins, vd_sub(vd_set1(0.0), quotient));
        else
            ends = vd_min(ends, vd_add(quotient, vd_set1(1.0)));
    }
    vi_store(first, vi_round(vd_min(begins, vd_set1(high))));
    vi_store(end, vi_round(vd_max(ends, vd_set1(low))));
}

TL_INLINE void walk_rows(const tl_triangle *t, const tl_window *window, const tl_target *shared, tl_sink sink)
{
    const tl_target own = *shared, *target = &own; /* a copy that no store can alias */
    const edges_64 e = setup_edges_64(t, window);
    const vd lanes = vd_from_vi(vi_iota());
    const double step = (double)((int64_t)2 << window->subpixel_bits), x0 = sample_x(t, window, t->col0);
    const vd xs = vd_add(vd_set1(x0), ramp(step)), slope_x = vd_set1(t->slope_x);
    const int is_wide = sink_keeps_order(sink) && t->col1 - t->col0 >= TL_LEAST_WIDE;
    const double x_left = sample_x(t, window, 0);
    int n_left = 0;
    int32_t first[TL_MAX_LANES], end[TL_MAX_LANES];
    double z_row[TL_MAX_LANES];
    for (int64_t row0 = t->row0; row0 < t->row1; row0 += TL_LANES) {
        const vd rows = vd_add(vd_set1((double)(row0 - t->row0)), lanes);
        find_row_ends(&e, rows, 0.0, (double)(t->col1 - t->col0), first, end);
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
            if (is_wide && first[k] < end[k] && looks_wide(target, end[k] - first[k], n_left)) {
                const plane_row row = {z_row[k], t->slope_x, x_left, step, t->id};
                n_left = put_wide(&row, target, sink, row0 + k, t->col0 + first[k], t->col0 + end[k]);
                continue;
            }
            n_left -= n_left > 0;
            const vd z = vd_set1(z_row[k]);
            for (int32_t col = first[k]; col < end[k]; col += TL_LANES) {
                const vd x = vd_add(xs, vd_set1(col * step));
                put_depths(target, sink, at + col, vm_first(end[k] - col), sum_depth(z, vd_mul(slope_x, x)), t->id);
            }
        }
    }
}

/* A box at most this wide is walked sample by sample, a wider one by its row ends. */
#define TL_EDGE_MAX_WIDTH 6

/* The ids of triangles in the picture. */
TL_INLINE vi names_of(const tl_snapped *snapped, vm m, vi id)
{
    return vi_add(snapped->names ? vi_gather(m, snapped->names, id) : id, vi_set1(snapped->first_id));
}
TL_INLINE int32_t name_of(const tl_snapped *snapped, int32_t id)
{
    return (snapped->names ? snapped->names[id] : id) + snapped->first_id;
}

/* Whether a set-up triangle is walked by float64 row ends; if not, sample by sample or by exact row ends. */
TL_INLINE int takes_rows(const tl_triangle *t, const tl_snapped *snapped, const tl_window *window, tl_sink sink)
{
    return snapped->method == TL_METHOD_AUTO && rows_fit(t, window, window->test != TL_TEST_SAMPLE) &&
           (!sink_has_depth(sink) || t->has_plane);
}
TL_INLINE int takes_edge(const tl_triangle *t, const tl_snapped *snapped)
{
    return snapped->method == TL_METHOD_EDGE ||
           (snapped->method == TL_METHOD_AUTO && t->col1 - t->col0 <= TL_EDGE_MAX_WIDTH);
}

/* Sets a triangle up; returns how it is drawn, or TL_CLASS_CULLED when there is nothing to draw. */
TL_ONCE tl_class setup_single_fixed(const tl_vertex_set *set, const int32_t *corners, int32_t id,
                                    const tl_snapped *snapped, const tl_window *window, const tl_target *target,
                                    tl_sink sink, tl_triangle *t)
{
    const tl_sink drawn = sink_of(target, sink);
    const int sign = load_triangle(set, corners, t);
    if (is_culled(sign, snapped->cull)) {
        count_faceless_one(target, sink, sign);
        return TL_CLASS_CULLED;
    }
    if (!clip_box(t, window)) {
        count_unseen_one(target, sink, t, window);
        return TL_CLASS_CULLED;
    }
    tl_count_work(window, (t->row1 - t->row0) * (t->col1 - t->col0));
    t->id = name_of(snapped, id);
    t->has_plane = 0;
    setup_sink(t, window, drawn);
    if (takes_rows(t, snapped, window, drawn))
        return TL_CLASS_LONG;
    if (takes_edge(t, snapped))
        return t->is_narrow ? TL_CLASS_EDGE_64 : TL_CLASS_EDGE_128;
    return t->is_narrow ? TL_CLASS_SPAN_64 : TL_CLASS_SPAN_128;
}

/* Draws a triangle that needs integers of 128 bits. */
TL_ONCE void walk_wide(const tl_triangle *t, const tl_window *window, const tl_target *target, tl_sink sink,
                       int by_edge)
{
    if (by_edge)
        walk_edge_128(t, window, target, sink);
    else
        walk_scanline_128(t, window, target, sink);
}

/* Draws one triangle by itself: any range, any method. */
TL_INLINE void draw_triangle(const tl_vertex_set *set, const int32_t *corners, int32_t id, const tl_snapped *snapped,
                             const tl_window *window, const tl_target *target, tl_sink sink)
{
    tl_triangle t;
    const tl_class walker = setup_single_fixed(set, corners, id, snapped, window, target, sink, &t);
    if (walker == TL_CLASS_CULLED)
        return;
    if (sink == TL_SINK_CENSUS)
        count_one(target->census, walker, &t, window->subpixel_bits);
    else if (walker == TL_CLASS_LONG)
        walk_rows(&t, window, target, sink);
    else if (walker == TL_CLASS_EDGE_64)
        walk_edge_64(&t, window, target, sink);
    else if (walker == TL_CLASS_SPAN_64)
        walk_scanline_64(&t, window, target, sink);
    else
        walk_wide(&t, window, target, sink, walker == TL_CLASS_EDGE_128);
}

/* The squares [first, end) of a row that a triangle meets, or holds. */
typedef struct {
    int64_t first, end;
} row_span;

static row_span square_span(const tl_triangle *t, const tl_window *window, int64_t row)
{
    row_span span = {0, 0};
    if (row < t->row0 || row >= t->row1)
        return span;
    const edges_128 e = setup_edges_128(t, window);
    tl_int128 first = i128_from(0), end = i128_from(t->col1 - t->col0);
    for (int k = 0; k < 3; k++) {
        tl_int128 quotient, remainder;
        const int is_left = i128_is_negative(e.dy[k]);
        if (i128_is_zero(e.dy[k]))
            continue;
        i128_floor_divide(i128_add(e.value[k], i128_times(e.dx[k], row - t->row0)),
                          is_left ? i128_neg(e.dy[k]) : e.dy[k], &quotient, &remainder);
        if (is_left)
            first = i128_max(first, i128_neg(quotient));
        else
            end = i128_min(end, i128_add(quotient, i128_from(1)));
    }
    if (i128_less(first, end))
        span = (row_span){t->col0 + i128_low(first), t->col0 + i128_low(end)};
    return span;
}

/* Counts the squares of a row in the union of spans, once each. */
static void count_spans(const row_span *spans, int n, const tl_window *window, const tl_target *target, int64_t row)
{
    for (int64_t done = 0, n_left = n; n_left > 0; n_left--) { /* the spans in the order of `first` */
        int64_t first = window->width, end = 0;
        for (int i = 0; i < n; i++) {
            const int64_t begin = max64(spans[i].first, done);
            if (begin < spans[i].end && (begin < first || (begin == first && spans[i].end > end)))
                first = begin, end = spans[i].end;
        }
        if (first >= end)
            break;
        put_plain(target, TL_SINK_COUNT, row * target->stride_px + first, end - first, 0);
        done = end;
    }
}

/* Counts the squares that any of a triangle's pieces meets, or holds; a square that several meet counts once. */
static __attribute__((noinline)) void count_squares(const tl_vertex_set *set, const int32_t *corners, int n_pieces,
                                                    const tl_snapped *snapped, const tl_window *window,
                                                    const tl_target *target)
{
    tl_triangle t[TL_MAX_PIECES];
    int64_t row0 = window->height, row1 = 0;
    int n = 0;
    for (int i = 0; i < n_pieces && n < TL_MAX_PIECES; i++) {
        const int sign = load_triangle(set, corners + 3 * i, &t[n]);
        if (is_culled(sign, snapped->cull) || !clip_box(&t[n], window))
            continue;
        row0 = min64(row0, t[n].row0);
        row1 = max64(row1, t[n].row1);
        n++;
    }
    for (int64_t row = row0; row < row1; row++) {
        row_span spans[TL_MAX_PIECES];
        for (int i = 0; i < n; i++)
            spans[i] = square_span(&t[i], window, row);
        count_spans(spans, n, window, target, row);
    }
}

/* Draws triangle i, or its pieces, by itself. */
TL_INLINE void draw_single_fixed(const tl_snapped *snapped, int64_t i, const tl_window *window, const tl_target *target,
                                 tl_sink sink)
{
    int32_t own[3];
    const triangle_parts parts = parts_of(snapped, i, own);
    if (sink == TL_SINK_COUNT && window->test != TL_TEST_SAMPLE && parts.n > 1) {
        count_squares(&parts.set, parts.corners, parts.n, snapped, window, target);
        return;
    }
    for (int k = 0; k < parts.n; k++)
        draw_triangle(&parts.set, parts.corners + 3 * k, (int32_t)i, snapped, window, target, sink);
}

TL_SINK_COPY(draw_single_fixed, samples, TL_SINK_SAMPLES,
             (const tl_snapped *snapped, int64_t i, const tl_window *window, const tl_target *target), snapped, i,
             window, target)
TL_SINK_COPIES(draw_single_fixed,
               (const tl_snapped *snapped, int64_t i, const tl_window *window, const tl_target *target), snapped, i,
               window, target)

#endif
