/* Draw: every triangle of a mesh whose vertices are not snapped, to the code for its size.
 * In: points in pixels and triangles.  Out: the target's buffers.
 *
 * A sample belongs to a triangle by the sign of the exact edge functions of the float64 numbers that stand in the
 * array, with the top-left rule where one is 0.  Boxes are exact: the samples in the extent, of which centre - x is
 * exact from column 0 on; left of it a rounded one may be one too low, and is compared. */
#ifndef TL_DRAW_EXACT_C
#define TL_DRAW_EXACT_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "exact/alone_exact.c"
#include "exact/boxes_exact.c"
#include "exact/rows_exact.c"
#include "exact/setup_exact.c"
#include "raster/batch.c"
#include "raster/covered.c"
#include "raster/raster.c"
#include "raster/sink.c"

/* TL_LANES triangles as loaded, and what becomes of them. */
typedef struct {
    vd x[3], y[3];
    vd width, height;
    vi col, row, n_cols, n_rows; /* the box of samples in the window */
    vm alone, drawn;
} exact_batch;

/* The first pixels whose samples are not left of x. */
TL_INLINE vi first_pixels(vd x, vd centre, int is_left_of_0)
{
    const vi n = vi_ceil(vd_sub(x, centre));
    if (!is_left_of_0)
        return n;
    const vm is_low = vm_and_not(vm_all(), vd_ge(vd_add(vd_from_vi(n), centre), x));
    return vi_add(n, vi_select(is_low, vi_set1(1), vi_set1(0)));
}

/* The boxes of squares that extents meet in more than a line, or hold. */
TL_INLINE void find_squares(vd low, vd high, tl_test test, int64_t least, int64_t most, vi *first, vi *n)
{
    const vi begin = test == TL_TEST_OUTER ? vi_round(vd_floor(low)) : vi_ceil(low);
    const vi end = test == TL_TEST_OUTER ? vi_ceil(high) : vi_round(vd_floor(high));
    *first = vi_max(begin, vi_set1((int32_t)least));
    *n = vi_sub(vi_min(end, vi_set1((int32_t)most)), *first);
}

/* The pixels around the extent of a triangle in which edges are tested. */
TL_INLINE double border_of(tl_test test) { return test == TL_TEST_SAMPLE ? 0.0 : 2.0; }

/* Loads TL_LANES triangles; returns 0, with the row in `bad_row`, when an index lies outside the vertices. */
TL_INLINE int load_exact_batch(exact_state *s, tl_sink sink, const int32_t *corners, vi id, vm live, exact_batch *b)
{
    if (has_bad_index(corners, s->last_vertex)) {
        int32_t ids[TL_MAX_LANES];
        vi_store(ids, id);
        s->bad_row = ids[0];
        return 0;
    }
    vd far = vd_set1(0.0); /* a sum, so that what is not finite shows */
    for (int k = 0; k < 3; k++) {
        vd_load_pairs(s->points->points, s->points->stride, corners + k, &b->x[k], &b->y[k]);
        far = vd_add(far, vd_add(vd_abs(b->x[k]), vd_abs(b->y[k])));
    }
    const vd x_min = vd_min(vd_min(b->x[0], b->x[1]), b->x[2]), x_max = vd_max(vd_max(b->x[0], b->x[1]), b->x[2]);
    const vd y_min = vd_min(vd_min(b->y[0], b->y[1]), b->y[2]), y_max = vd_max(vd_max(b->y[0], b->y[1]), b->y[2]);
    b->width = vd_sub(x_max, x_min), b->height = vd_sub(y_max, y_min);
    const tl_test test = test_of(s, sink);
    const vd widest = vd_set1(TL_MAX_BOX_PX - border_of(test));
    const vm fits = vm_and(vd_ge(vd_set1(0x1p30), far), vd_ge(widest, vd_max(b->width, b->height)));
    b->alone = vm_and_not(live, fits);
    if (test != TL_TEST_SAMPLE) {
        find_squares(x_min, x_max, test, s->left, s->right, &b->col, &b->n_cols);
        find_squares(y_min, y_max, test, s->top, s->bottom, &b->row, &b->n_rows);
        b->drawn = vm_and(vm_and(live, fits), vi_gt(vi_min(b->n_cols, b->n_rows), vi_set1(0)));
        return 1;
    }
    const vd centre_x = vd_set1(s->centre_x), centre_y = vd_set1(s->centre_y);
    const int is_left_of_0 = s->left < 0 || s->top < 0;
    b->col = vi_max(first_pixels(x_min, centre_x, is_left_of_0), vi_set1((int32_t)s->left));
    b->row = vi_max(first_pixels(y_min, centre_y, is_left_of_0), vi_set1((int32_t)s->top));
    b->n_cols = vi_sub(vi_min(first_pixels(x_max, centre_x, is_left_of_0), vi_set1((int32_t)s->right)), b->col);
    b->n_rows = vi_sub(vi_min(first_pixels(y_max, centre_y, is_left_of_0), vi_set1((int32_t)s->bottom)), b->row);
    b->drawn = vm_and(vm_and(live, fits), vi_gt(vi_min(b->n_cols, b->n_rows), vi_set1(0)));
    return 1;
}

/* Leaves to draw_lone what lanes could take but should not, and to nobody what is turned away for certain. */
TL_INLINE void take_out_exact(const exact_state *s, tl_sink sink, exact_batch *b)
{
    if (TL_LANES == 1) { /* one lane gains nothing from the rows of rows_exact.c */
        const vm over_small = vm_and(b->drawn, vi_gt(vi_max(b->n_cols, b->n_rows), vi_set1(TL_SMALL_BOX)));
        b->alone = vm_or(b->alone, over_small);
        b->drawn = vm_and_not(b->drawn, over_small);
    }
    if (!sink_has_depth(sink) && s->mesh->cull == TL_CULL_NONE)
        return;
    const vd area = area_of_points(b->x, b->y), box = vd_mul(b->width, b->height);
    const vd bound = vd_add(vd_mul(box, vd_set1(0x1p-50)), vd_set1(1e-280)), zero = vd_set1(0.0);
    if (s->mesh->cull != TL_CULL_NONE)
        b->drawn = vm_and_not(b->drawn, vd_ge(s->mesh->cull == TL_CULL_BACK ? area : vd_sub(zero, area), bound));
    if (sink_has_depth(sink)) { /* as plane_of_points; the extents of lanes are in its range */
        const vd scaled = vd_mul(vd_abs(area), vd_set1((double)(1 << TL_SLIVER_BITS)));
        const vm has_plane = vm_and(vd_ge(scaled, box), vd_ge(box, vd_set1(TL_LEAST_BOX)));
        b->alone = vm_or(b->alone, vm_and_not(b->drawn, has_plane));
        b->drawn = vm_and(b->drawn, has_plane);
    }
}

static __attribute__((noinline)) void draw_each_lone(exact_state *s, tl_sink sink, unsigned lanes, const int32_t *ids)
{
    for (; lanes && s->bad_row < 0 && !tl_is_given_up(s->window); lanes &= lanes - 1)
        TL_SINK_CALL(draw_lone, sink, s, ids[__builtin_ctz(lanes)])
}

TL_INLINE void push_exact(exact_queue *queue, vm m, const exact_batch *b, vi id, vf xy)
{
    vi_compress((int32_t *)(queue->xy + queue->boxes.n), m, vi_bits_of_vf(xy));
    push(&queue->boxes, m, b->col, b->row, b->n_cols, b->n_rows, id);
}
#define TL_IS_FULL(queue) ((queue).boxes.n > TL_QUEUE - TL_LANES)

TL_INLINE void draw_exact_batch(exact_state *s, tl_sink sink, const int32_t *corners, vi id, vm live)
{
    exact_batch b;
    for (int k = 0; k < 3 * TL_LANES; k += 16)
        __builtin_prefetch(corners + 12 * 48 + k);
    if (!load_exact_batch(s, sink, corners, id, live, &b))
        return;
    if (!vm_any(vm_or(b.drawn, b.alone)))
        return;
    take_out_exact(s, sink, &b);
    if (__builtin_expect(vm_any(b.alone), 0)) {
        int32_t ids[TL_MAX_LANES];
        vi_store(ids, id);
        draw_each_lone(s, sink, vm_bits(b.alone), ids);
    }
    if (!vm_any(b.drawn))
        return;
    const vf one = vf_set1(1.0f), border = vf_set1((float)border_of(test_of(s, sink)));
    const vf width = vf_add(vf_from_vd(b.width), border), height = vf_add(vf_from_vd(b.height), border);
    const vf xy = vf_mul(vf_max(width, one), vf_max(height, one));
    const vi longer = vi_max(b.n_cols, b.n_rows);
    const vm over_tiny = vi_gt(longer, vi_set1(2)), over_small = vi_gt(longer, vi_set1(TL_SMALL_BOX));
    const vm over = vm_and(b.drawn, over_small), tiny = vm_and_not(b.drawn, over_tiny);
    const vm small = vm_and(b.drawn, vm_and_not(over_tiny, over_small));
    const vm beyond = vm_or(vi_gt(b.n_cols, vi_set1(TL_LANES)), vi_gt(b.n_rows, vi_set1(TL_MIDDLE_BOX)));
    const vm middle = vm_and_not(over, beyond), rows = vm_and(over, beyond);
    if (vm_any(tiny)) {
        push_exact(&s->tiny, tiny, &b, id, xy);
        if (TL_IS_FULL(s->tiny))
            TL_SINK_CALL(flush_tiny_exact, sink, s)
    }
    if (vm_any(small)) {
        push_exact(&s->small, small, &b, id, xy);
        if (TL_IS_FULL(s->small))
            TL_SINK_CALL(flush_small_exact, sink, s)
    }
    if (vm_any(middle)) {
        push_exact(&s->middle, middle, &b, id, xy);
        if (TL_IS_FULL(s->middle))
            TL_SINK_CALL(flush_middle_exact, sink, s)
    }
    if (vm_any(rows)) {
        push_exact(&s->rows, rows, &b, id, xy);
        if (TL_IS_FULL(s->rows))
            TL_SINK_CALL(flush_rows_exact, sink, s)
    }
}

/* The same where int32 cannot count pixels: all by themselves. */
TL_INLINE void draw_far_batch(exact_state *s, tl_sink sink, const int32_t *corners, vi id, vm live)
{
    int32_t ids[TL_MAX_LANES];
    vi_store(ids, id);
    if (has_bad_index(corners, s->last_vertex))
        s->bad_row = ids[0];
    else
        draw_each_lone(s, sink, vm_bits(live), ids);
}

/* The window has fewer than 2^31 samples and lies within 2^48 pixels of 0, where centres and samples are float64. */
static void start_exact(exact_state *s, const tl_snapped *mesh, const tl_exact_points *points, const tl_window *window,
                        const tl_target *target, tl_exact_counts *counts)
{
    s->mesh = mesh, s->points = points, s->window = window, s->target = target, s->counts = counts;
    s->left = window->x_px, s->right = window->x_px + window->width;
    s->top = window->y_px, s->bottom = window->y_px + window->height;
    const int of_squares = window->test != TL_TEST_SAMPLE;
    s->centre_x = of_squares ? 0.0 : 0.5 + points->sample_x_px,
    s->centre_y = of_squares ? 0.0 : 0.5 + points->sample_y_px;
    s->last_vertex = vi_set1((int32_t)(points->n_points - 1));
    s->bad_row = -1, s->may_be_on_grid = 0;
    s->tiny.boxes.n = s->small.boxes.n = s->middle.boxes.n = s->rows.boxes.n = s->fragments.n = 0;
    memset(s->fragments.sample, 0, sizeof s->fragments.sample); /* what is prefetched behind the end of the list */
}

TL_INLINE void draw_exact_scene(const tl_snapped *mesh, const tl_exact_points *points, const tl_window *window,
                                const tl_target *target, const tl_share *share, tl_exact_counts *counts,
                                int64_t *bad_row, tl_sink sink)
{
    const int64_t farthest = (int64_t)1 << 30;
    const int is_near_0 =
        is_near(window) && window->x_px + window->width < farthest && window->y_px + window->height < farthest;
    exact_state s;
    int is_given_up = 0;
    start_exact(&s, mesh, points, window, target, counts);
    const int counts_pieces = sink == TL_SINK_COUNT && window->test != TL_TEST_SAMPLE;
    const int64_t end = counts_pieces ? min64(share->end, points->n_whole) : share->end;
    for (int64_t i = share->first; i < end && s.bad_row < 0 && !is_given_up; i += TL_LANES) {
        int32_t corners[3 * TL_LANES];
        tl_count_work(window, TL_SETUP_PX * TL_LANES);
        is_given_up = tl_is_given_up(window);
        const vm live = vm_first(end - i);
        const vi id = share->ids ? vi_load_masked(live, share->ids + i) : vi_add(vi_set1((int32_t)i), vi_iota());
        const int32_t *batch = share_corners(mesh, share, i, corners);
        if (is_near_0)
            draw_exact_batch(&s, sink, batch, id, live);
        else
            draw_far_batch(&s, sink, batch, id, live);
    }
    TL_SINK_CALL(flush_tiny_exact, sink, &s)
    TL_SINK_CALL(flush_small_exact, sink, &s)
    TL_SINK_CALL(flush_middle_exact, sink, &s)
    TL_SINK_CALL(flush_rows_exact, sink, &s)
    flush_fragments(target, sink, &s.fragments, s.fragments.n);
    if (counts_pieces && s.bad_row < 0)
        count_pieces(&s, max64(share->first, points->n_whole), share->end);
    *bad_row = s.bad_row;
}

TL_SINK_COPIES(draw_exact_scene,
               (const tl_snapped *mesh, const tl_exact_points *points, const tl_window *window, const tl_target *target,
                const tl_share *share, tl_exact_counts *counts, int64_t *bad_row),
               mesh, points, window, target, share, counts, bad_row)

static int64_t draw_exact(const tl_snapped *mesh, const tl_exact_points *points, const tl_window *window,
                          const tl_target *target, const tl_share *share, tl_exact_counts *counts)
{
    const int64_t pixel_bytes = target->sink == TL_SINK_MASK ? 1 : 4;
    const int64_t rows_at_once = max64(1, (((int64_t)1 << 31) - 1) / target->stride_px);
    for (int64_t row = 0; row < window->height; row += rows_at_once) {
        tl_window band = *window;
        tl_target part = *target;
        band.y_px += row;
        band.height = min64(rows_at_once, window->height - row);
        part.pixels = target->pixels ? (char *)target->pixels + row * target->stride_px * pixel_bytes : NULL;
        part.depth = target->depth ? target->depth + row * target->stride_px : NULL;
        part.n_samples = part.stride_px * (band.height - 1) + band.width;
        int64_t bad_row = -1;
        if (share->is_first)
            clear(&band, &part);
        if (share->first < share->end)
            TL_SINK_CALL(draw_exact_scene, target->sink, mesh, points, &band, &part, share, counts, &bad_row)
        if (bad_row >= 0)
            return bad_row;
        if (target->sink == TL_SINK_MASK && share->is_last)
            expand_covered(&band, &part);
    }
    return -1;
}

#endif
