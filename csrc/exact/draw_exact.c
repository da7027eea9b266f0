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
#include "few/few.c"
#include "exact/alone_exact.c"
#include "exact/boxes_exact.c"
#include "exact/pieces_exact.c"
#include "exact/rows_exact.c"
#include "exact/setup_exact.c"
#include "raster/batch.c"
#include "raster/covered.c"
#include "raster/raster.c"
#include "raster/sink.c"

/* TL_LANES triangles as loaded, and what becomes of them. */
typedef struct {
    lane_exact t;
    vi x_fx[3], y_fx[3];         /* places, where vertices have them */
    int is_placed;               /* boxes are those of the places: none has more than 4x4 samples */
    vi top, bottom;              /* rows of the box in the picture */
    vi col, row, n_cols, n_rows; /* the box of samples in the window */
    vf xy;                       /* as the head of setup_exact.c has it */
    vm alone, fits, drawn;       /* fits: the others, drawn or not */
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

/* The pixels from *first to *end whose samples lie in extents, or whose squares meet them in more than a line, or lie
 * in them. */
TL_INLINE void find_pixels_of(vd low, vd high, tl_test test, double centre, int is_left_of_0, vi *first, vi *end)
{
    const vd at = vd_set1(centre);
    if (test == TL_TEST_SAMPLE) {
        *first = first_pixels(low, at, is_left_of_0), *end = first_pixels(high, at, is_left_of_0);
        return;
    }
    *first = test == TL_TEST_OUTER ? vi_round(vd_floor(low)) : vi_ceil(low);
    *end = test == TL_TEST_OUTER ? vi_ceil(high) : vi_round(vd_floor(high));
}

/* The pixels around the extent of a triangle in which edges are tested. */
TL_INLINE double border_of(tl_test test) { return test == TL_TEST_SAMPLE ? 0.0 : 2.0; }

/* Cuts boxes to the window, and finds which have a sample. */
TL_INLINE void cut_boxes(const exact_state *s, vi left, vi right, exact_batch *b)
{
    b->col = vi_max(left, vi_set1((int32_t)s->left));
    b->row = vi_max(b->top, vi_set1((int32_t)s->top));
    b->n_cols = vi_sub(vi_min(right, vi_set1((int32_t)s->right)), b->col);
    b->n_rows = vi_sub(vi_min(b->bottom, vi_set1((int32_t)s->bottom)), b->row);
    b->drawn = vm_and(b->fits, vi_gt(vi_min(b->n_cols, b->n_rows), vi_set1(0)));
}

/* The boxes of the points. */
TL_INLINE void find_boxes_of_points(const exact_state *s, tl_sink sink, vm live, exact_batch *b)
{
    const vd *x = b->t.x, *y = b->t.y;
    const vd sum = vd_add(vd_add(vd_add(x[0], x[1]), vd_add(y[0], y[1])), vd_add(x[2], y[2]));
    const vd x_min = vd_min(vd_min(x[0], x[1]), x[2]), x_max = vd_max(vd_max(x[0], x[1]), x[2]);
    const vd y_min = vd_min(vd_min(y[0], y[1]), y[2]), y_max = vd_max(vd_max(y[0], y[1]), y[2]);
    const vd width = vd_sub(x_max, x_min), height = vd_sub(y_max, y_min);
    const tl_test test = test_of(s, sink);
    const vf one = vf_set1(1.0f), border = vf_set1((float)border_of(test));
    const vd widest = vd_set1(TL_MAX_BOX_PX - border_of(test));
    const vd farthest = vd_max(vd_max(x_max, y_max), vd_sub(vd_set1(0.0), vd_min(x_min, y_min)));
    const vm in_range = vm_and(vd_ge(vd_set1(0x1p30), farthest), vd_ge(vd_set1(0x1p33), sum)); /* not where it is NaN */
    const vm fits = vm_and(in_range, vd_ge(widest, vd_max(width, height)));
    const int is_left_of_0 = s->left < 0 || s->top < 0;
    vi left, right;
    b->alone = vm_and_not(live, fits), b->fits = vm_and(live, fits);
    find_pixels_of(x_min, x_max, test, s->centre_x, is_left_of_0, &left, &right);
    find_pixels_of(y_min, y_max, test, s->centre_y, is_left_of_0, &b->top, &b->bottom);
    cut_boxes(s, left, right, b);
    b->xy = vf_mul(vf_max(vf_add(vf_from_vd(width), border), one), vf_max(vf_add(vf_from_vd(height), border), one));
}

/* The pixels whose samples lie between places, or up to a unit beside them. */
TL_INLINE void find_pixels_of_places(vi low, vi high, double centre, vi *first, vi *end)
{
    const int32_t at = place_of(centre), unit = 1 << TL_PLACE_BITS;
    *first = vi_shift_right(vi_add(low, vi_set1(unit - 2 - at)), TL_PLACE_BITS);
    *end = vi_shift_right(vi_add(high, vi_set1(unit + 1 - at)), TL_PLACE_BITS);
}

/* The boxes of the places; returns 0 where one has more than 4x4 samples and has to be exact. */
TL_INLINE int find_boxes_of_places(const exact_state *s, vm live, exact_batch *b)
{
    const vi *x = b->x_fx, *y = b->y_fx;
    const vi x_min = vi_min(vi_min(x[0], x[1]), x[2]), x_max = vi_max(vi_max(x[0], x[1]), x[2]);
    const vi y_min = vi_min(vi_min(y[0], y[1]), y[2]), y_max = vi_max(vi_max(y[0], y[1]), y[2]);
    const vi width = vi_sub(x_max, x_min), height = vi_sub(y_max, y_min);
    const vi widest = vi_set1(TL_MAX_BOX_PX << TL_PLACE_BITS);
    const vf one = vf_set1(1.0f), unit = vf_set1(TL_PLACE_UNIT);
    /* a special vertex has TL_SPECIAL for x: its triangle is too wide, or special throughout */
    const vm too_large = vm_or(vi_gt_unsigned(width, widest), vi_gt_unsigned(height, widest));
    vi left, right;
    b->alone = vm_and(live, vm_or(too_large, vi_eq(x_min, vi_set1(TL_SPECIAL)))), b->fits = vm_and_not(live, b->alone);
    find_pixels_of_places(x_min, x_max, s->centre_x, &left, &right);
    find_pixels_of_places(y_min, y_max, s->centre_y, &b->top, &b->bottom);
    cut_boxes(s, left, right, b);
    b->xy = vf_mul(vf_max(vf_mul(vf_from_vi(width), unit), one), vf_max(vf_mul(vf_from_vi(height), unit), one));
    return !vm_any(vm_and(b->drawn, vi_gt(vi_max(b->n_cols, b->n_rows), vi_set1(TL_SMALL_BOX))));
}

/* Loads TL_LANES triangles; returns 0, with the row in `bad_row`, when an index lies outside the vertices. */
TL_INLINE int load_exact_batch(exact_state *s, tl_sink sink, const int32_t *corners, vi id, vm live, exact_batch *b)
{
    if (has_bad_index(corners, s->last_vertex)) {
        int32_t ids[TL_MAX_LANES];
        vi_store(ids, id);
        s->bad_row = ids[0];
        return 0;
    }
    b->is_placed = 0;
    if (sink_has_depth(sink) && s->has_places) {
        for (int k = 0; k < 3; k++)
            vd_load_places(s->points->points, corners + k, &b->t.x[k], &b->t.y[k], &b->t.z[k], &b->x_fx[k],
                           &b->y_fx[k]);
        b->is_placed = find_boxes_of_places(s, live, b);
    } else {
        load_points(s->points, sink, corners, b->t.x, b->t.y, b->t.z);
    }
    if (!b->is_placed)
        find_boxes_of_points(s, sink, live, b);
    return 1;
}

/* As list_others in raster.c. */
TL_INLINE void list_exact_others(const exact_state *s, const exact_batch *b, vi id)
{
    tl_share *share = s->share;
    const tl_window *picture = share->picture;
    const vi first = vi_max(b->top, vi_set1((int32_t)picture->y_px));
    const vi end = vi_min(b->bottom, vi_set1((int32_t)(picture->y_px + picture->height)));
    const vm is_seen = vm_and(b->fits, vm_and(vi_gt(b->n_cols, vi_set1(0)), vi_gt(end, first)));
    const vm is_beyond = vm_or(vi_gt(b->row, first), vi_gt(end, vi_set1((int32_t)s->bottom)));
    const vm m = vm_or(b->alone, vm_and(is_seen, is_beyond));
    vi_compress(share->others + share->n_others, m, id);
    share->n_others += __builtin_popcount(vm_bits(m));
}

/* Leaves to draw_lone what lanes could take but should not, and to nobody what is turned away for certain. */
TL_INLINE void take_out_exact(const exact_state *s, exact_batch *b)
{
    if (TL_LANES == 1) { /* one lane gains nothing from the rows of rows_exact.c */
        const vm over_small = vm_and(b->drawn, vi_gt(vi_max(b->n_cols, b->n_rows), vi_set1(TL_SMALL_BOX)));
        b->alone = vm_or(b->alone, over_small);
        b->drawn = vm_and_not(b->drawn, over_small);
    }
    if (s->mesh->cull == TL_CULL_NONE)
        return;
    const vd *x = b->t.x, *y = b->t.y;
    const vd width = vd_sub(vd_max(vd_max(x[0], x[1]), x[2]), vd_min(vd_min(x[0], x[1]), x[2]));
    const vd height = vd_sub(vd_max(vd_max(y[0], y[1]), y[2]), vd_min(vd_min(y[0], y[1]), y[2]));
    const vd area = area_of_points(x, y), box = vd_mul(width, height);
    const vd bound = vd_add(vd_mul(box, vd_set1(0x1p-50)), vd_set1(1e-280)), zero = vd_set1(0.0);
    b->drawn = vm_and_not(b->drawn, vd_ge(s->mesh->cull == TL_CULL_BACK ? area : vd_sub(zero, area), bound));
}

static __attribute__((noinline)) void draw_each_lone(exact_state *s, unsigned lanes, const int32_t *ids)
{
    for (; lanes && s->bad_row < 0 && !tl_is_given_up(s->window); lanes &= lanes - 1)
        TL_SINK_CALL(draw_lone, s->target->sink, s, ids[__builtin_ctz(lanes)])
}

/* What the queues have put by. */
static __attribute__((noinline)) void draw_slivers(exact_state *s)
{
    for (int k = 0; k < s->n_slivers && s->bad_row < 0 && !tl_is_given_up(s->window); k++)
        TL_SINK_CALL(draw_lone, s->target->sink, s, s->slivers[k])
    s->n_slivers = 0;
}

TL_INLINE void push_exact(exact_queue *queue, vm m, const exact_batch *b, vi id)
{
    vi_compress((int32_t *)(queue->xy + queue->boxes.n), m, vi_bits_of_vf(b->xy));
    push(&queue->boxes, m, b->col, b->row, b->n_cols, b->n_rows, id);
}
#define TL_IS_FULL(queue) ((queue).boxes.n > TL_QUEUE - TL_LANES)

/* Fewer boxes of up to 2x2 samples wait with the small ones; others are tested where they are. */
#define TL_FEW_TINY ((TL_LANES + 3) / 4)

TL_INLINE void draw_tiny_exact(exact_state *s, tl_sink sink, exact_batch *b, vi id, vm tiny)
{
    lane_exact *t = &b->t;
    t->ids = id, t->live = tiny;
    place_exact(s, sink, b->col, b->row, b->xy, t);
    if (sink_has_depth(sink) && b->is_placed)
        measure_places(s, b->x_fx, b->y_fx, b->col, b->row, t);
    else
        measure_points(t);
    s->fragments.n = draw_exact_boxes(s, sink, t, b->n_cols, b->n_rows, 2, s->fragments.n);
}

TL_INLINE void draw_exact_batch(exact_state *s, tl_sink sink, const int32_t *corners, vi id, vm live)
{
    exact_batch b;
    if (!load_exact_batch(s, sink, corners, id, live, &b))
        return;
    if (s->share->others)
        list_exact_others(s, &b, id);
    if (!vm_any(vm_or(b.drawn, b.alone)))
        return;
    take_out_exact(s, &b);
    if (__builtin_expect(vm_any(b.alone), 0)) {
        int32_t ids[TL_MAX_LANES];
        vi_store(ids, id);
        draw_each_lone(s, vm_bits(b.alone), ids);
    }
    if (!vm_any(b.drawn))
        return;
    const vi longer = vi_max(b.n_cols, b.n_rows);
    const vm over_small = vi_gt(longer, vi_set1(TL_SMALL_BOX)), over = vm_and(b.drawn, over_small);
    const vm tiny = vm_and_not(b.drawn, vi_gt(longer, vi_set1(2)));
    vm small = vm_and_not(b.drawn, over_small);
    const vm beyond = vm_or(vi_gt(b.n_cols, vi_set1(TL_LANES)), vi_gt(b.n_rows, vi_set1(TL_MIDDLE_BOX)));
    const vm middle = vm_and_not(over, beyond), rows = vm_and(over, beyond);
    if (__builtin_popcount(vm_bits(tiny)) >= TL_FEW_TINY) {
        draw_tiny_exact(s, sink, &b, id, tiny);
        small = vm_and_not(small, tiny);
    }
    if (vm_any(small)) {
        push_exact(&s->small, small, &b, id);
        if (TL_IS_FULL(s->small))
            TL_LIST_CALL(flush_small_exact, sink, s)
    }
    if (vm_any(middle)) {
        push_exact(&s->middle, middle, &b, id);
        if (TL_IS_FULL(s->middle))
            TL_LIST_CALL(flush_middle_exact, sink, s)
    }
    if (vm_any(rows)) {
        push_exact(&s->rows, rows, &b, id);
        if (TL_IS_FULL(s->rows))
            TL_LIST_CALL(flush_rows_exact, sink, s)
    }
}

/* The same where int32 cannot count pixels: all by themselves. */
TL_INLINE void draw_far_batch(exact_state *s, const int32_t *corners, vi id, vm live)
{
    int32_t ids[TL_MAX_LANES];
    vi_store(ids, id);
    if (has_bad_index(corners, s->last_vertex))
        s->bad_row = ids[0];
    else
        draw_each_lone(s, vm_bits(live), ids);
}

/* Whether int32 counts the pixels of a window. */
TL_INLINE int is_near_0(const tl_window *window)
{
    const int64_t farthest = (int64_t)1 << 30;
    return is_near(window) && window->x_px + window->width < farthest && window->y_px + window->height < farthest;
}

/* The window has fewer than 2^31 samples and lies within 2^48 pixels of 0, where centres and samples are float64. */
static void start_exact(exact_state *s, const tl_snapped *mesh, const tl_window *window, const tl_target *target,
                        tl_exact_counts *counts)
{
    const tl_exact_points *points = mesh->mesh.exact;
    const double unit = 1.0 / (double)(1 << window->subpixel_bits);
    s->mesh = mesh, s->points = points, s->window = window, s->target = target, s->counts = counts;
    s->left = window->x_px, s->right = window->x_px + window->width;
    s->top = window->y_px, s->bottom = window->y_px + window->height;
    const int of_squares = window->test != TL_TEST_SAMPLE;
    s->centre_x = of_squares ? 0.0 : 0.5 + mesh->mesh.sample_x_fx * unit;
    s->centre_y = of_squares ? 0.0 : 0.5 + mesh->mesh.sample_y_fx * unit;
    s->last_vertex = vi_set1((int32_t)(points->n_points - 1));
    s->has_places = points->stride == TL_PLACED && max64(-s->left, s->right) <= TL_PLACE_LIMIT_PX - TL_MAX_BOX_PX - 2 &&
                    max64(-s->top, s->bottom) <= TL_PLACE_LIMIT_PX - TL_MAX_BOX_PX - 2;
    s->bad_row = -1, s->may_be_on_grid = 0, s->n_slivers = 0;
    s->small.boxes.n = s->middle.boxes.n = s->rows.boxes.n = s->fragments.n = 0;
    memset(s->fragments.sample, 0, sizeof s->fragments.sample); /* what is prefetched behind the end of the list */
}

/* The pieces of listed triangles. */
static __attribute__((noinline)) void draw_listed_pieces(exact_state *s, int64_t n_whole, const tl_share *share)
{
    const tl_exact_pieces *pieces = s->points->pieces;
    for (int64_t i = share->first; i < share->end; i++) {
        int64_t k = first_exact_piece(pieces, share->ids[i]);
        for (; k < pieces->n_pieces && pieces->source[k] == share->ids[i]; k++) {
            if (s->bad_row >= 0 || tl_is_given_up(s->window))
                return;
            TL_SINK_CALL(draw_lone, s->target->sink, s, (int32_t)(n_whole + k))
        }
    }
}

/* The triangles [n_whole, end) are pieces. */
TL_INLINE void draw_exact_scene(const tl_snapped *mesh, int64_t n_whole, const tl_window *window,
                                const tl_target *target, tl_share *share, tl_exact_counts *counts, int64_t *bad_row,
                                tl_sink sink)
{
    const int takes_lanes = is_near_0(window);
    exact_state s;
    int32_t own[3 * TL_LANES];
    int is_given_up = 0;
    start_exact(&s, mesh, window, target, counts);
    s.share = share;
    const int counts_pieces = target->sink == TL_SINK_COUNT && window->test != TL_TEST_SAMPLE;
    const int64_t end = counts_pieces ? min64(share->end, n_whole) : share->end;
    for (int64_t i = share->first; i < end && s.bad_row < 0 && !is_given_up; i += TL_LANES) {
        tl_count_work(window, TL_SETUP_PX * TL_LANES);
        is_given_up = tl_is_given_up(window);
        const vm live = vm_first(end - i);
        const vi id = share->ids ? vi_load_masked(live, share->ids + i) : vi_add(vi_set1((int32_t)i), vi_iota());
        const int32_t *corners = share_corners(mesh, share, i, own);
        if (!share->ids && i + 5 * TL_LANES <= end)
            fetch_rows(s.points->points, s.points->stride * sizeof(double), mesh->triangles + 3 * (i + 4 * TL_LANES));
        if (takes_lanes)
            draw_exact_batch(&s, sink, corners, id, live);
        else
            draw_far_batch(&s, corners, id, live);
        if (__builtin_expect(s.n_slivers > 0, 0))
            draw_slivers(&s);
    }
    TL_LIST_CALL(flush_small_exact, sink, &s)
    TL_LIST_CALL(flush_middle_exact, sink, &s)
    TL_LIST_CALL(flush_rows_exact, sink, &s)
    draw_slivers(&s);
    if (share->ids && s.points->pieces)
        draw_listed_pieces(&s, n_whole, share);
    flush_fragments(target, &s.fragments, s.fragments.n);
    if (counts_pieces && s.bad_row < 0)
        count_pieces(&s, max64(share->first, n_whole), share->end);
    *bad_row = s.bad_row;
}

TL_LIST_COPIES(draw_exact_scene,
               (const tl_snapped *mesh, int64_t n_whole, const tl_window *window, const tl_target *target,
                tl_share *share, tl_exact_counts *counts, int64_t *bad_row),
               mesh, n_whole, window, target, share, counts, bad_row)

/* The mesh with the triangles that are drawn: without those that planes cut, with the pieces behind the others. */
static tl_snapped drawn_mesh(const tl_snapped *snapped)
{
    const tl_exact_points *points = snapped->mesh.exact;
    tl_snapped drawn = *snapped;
    drawn.triangles = points->triangles, drawn.n_triangles = points->n_triangles;
    drawn.mesh.n_vertices = points->n_points;
    drawn.names = points->names ? points->names : snapped->names; /* pieces are of clip space, where none are given */
    return drawn;
}

/* A band of less than 2^31 pixels. */
static int64_t draw_exact(const tl_snapped *snapped, const tl_window *band, const tl_target *part, tl_share *share)
{
    const tl_snapped drawn = drawn_mesh(snapped);
    const int has_all = !share->ids && share->end == snapped->n_triangles;
    tl_exact_counts counts = {0, 0, 0, 0, 0, 0};
    tl_share own = *share;
    int64_t bad_row = -1;
    own.end = has_all ? drawn.n_triangles : share->end;
    if (own.first < own.end)
        TL_LIST_CALL(draw_exact_scene, part->sink, &drawn, snapped->n_triangles, band, part, &own, &counts, &bad_row)
    share->n_others = own.n_others;
    if (share->counts) {
        share->counts->n_triangles += counts.n_triangles;
        share->counts->n_on_grid += counts.n_on_grid;
        share->counts->n_asked += counts.n_asked;
        share->counts->n_turns += counts.n_turns;
        share->counts->n_expansions += counts.n_expansions;
        share->counts->n_integers += counts.n_integers;
    }
    return bad_row;
}

/* A mesh of either kind. */
static int64_t draw_mesh(const tl_snapped *snapped, const tl_window *window, const tl_target *target, tl_share *share)
{
    if (draws_few(snapped, window, target, share))
        return draw_few(snapped, window, target);
    return draw_bands_of(snapped, window, target, share, snapped->mesh.exact ? draw_exact : draw_part);
}

#endif
