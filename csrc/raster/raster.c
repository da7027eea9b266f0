/* Raster: setup and cull of every triangle of a mesh, a vector of triangles at a time, and the walker for its size.
 * In: vertices and triangles.  Out: the target's buffers. */
#ifndef TL_RASTER_C
#define TL_RASTER_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/clip.c"
#include "vertex/exact.h"
#include "vertex/fixed.h"
#include "vertex/setup.c"
#include "vertex/snap.c"
#include "clusters/cluster_view.c"
#include "clusters/clusters.h"
#include "sink/census.c"
#include "sink/covered.c"
#include "sink/peel.c"
#include "sink/sink.c"
#include "raster/single_fixed.c"
#include "raster/single_float.c"
#include "raster/boxes.c"
#include "raster/rows.c"
#include "raster/sampled.c"
#include "raster/sampled_single.c"
#include "raster/state.h"
#include "raster/triangles_fixed.c"
#include "raster/triangles_float.c"

TL_INLINE void draw_one_fixed(const tl_snapped *snapped, int64_t i, const tl_window *window, const tl_target *target,
                              tl_sink sink)
{
    if (sink == TL_SINK_CENSUS)
        draw_single_fixed(snapped, i, window, target, sink);
    else if (sink == TL_SINK_SAMPLES)
        draw_single_each_sample(snapped, i, window, target);
    else
        TL_SINK_CALL(draw_single_fixed, target->sink, snapped, i, window, target)
}

/* Loads TL_LANES triangles, and finds those that lanes can process, and for TL_FLOAT their boxes.  Returns 0, with the
 * row in `bad_row`, when an index lies outside the vertices. */
TL_INLINE int load_batch(walk_state *s, tl_geometry g, tl_sink sink, const int32_t *corners, vi id, vm live,
                         lane_batch *b)
{
    if (has_bad_index(corners, s->limits.last_vertex)) {
        int32_t ids[TL_MAX_LANES];
        vi_store(ids, id);
        s->bad_row = ids[0];
        return 0;
    }
    if (g == TL_FIXED)
        load_fixed_batch(s, corners, live, b);
    else
        load_float_batch(s, sink, corners, live, b);
    return 1;
}

/* Lists the triangles that reach rows of the picture that other passes draw. */
TL_INLINE void list_outside(const walk_state *s, const lane_batch *b, vi id)
{
    tl_slice *slice = s->slice;
    const batch_limits *limits = &s->limits;
    const vi first = vi_max(b->top, vi_set1(limits->picture_top));
    const vi end = vi_min(b->bottom, vi_set1(limits->picture_bottom));
    const vm is_seen = vm_and(b->drawn, vm_and(vi_gt(b->n_cols, vi_set1(0)), vi_gt(end, first)));
    const vm is_beyond = vm_or(vi_gt(b->row, first), vi_gt(end, vi_set1(limits->bottom)));
    const vm m = vm_or(b->single, vm_and(is_seen, is_beyond));
    slice->n_outside += vi_compress(slice->outside + slice->n_outside, m, id);
}

/* The shorter side of boxes before clipping to the window. */
TL_INLINE vi shorter_side(const walk_state *s, const lane_batch *b)
{
    const int bits = s->window->subpixel_bits;
    const vi first = extent_pixels(b->extents.x_min, s->limits.round.first, bits);
    const vi end = extent_pixels(b->extents.x_max, s->limits.round.end, bits);
    return vi_min(vi_sub(end, first), vi_sub(b->bottom, b->top));
}

/* Moves triangles that lanes should not process to the single ones, and drops triangles that are certainly culled. */
TL_INLINE void take_out(const walk_state *s, tl_geometry g, tl_sink sink, lane_batch *b)
{
    if (TL_LANES == 1) { /* a single lane gains nothing from rows.c */
        const vm over_small = vm_and(b->drawn, vi_gt(vi_max(b->n_cols, b->n_rows), vi_set1(TL_SMALL_BOX)));
        b->single = vm_or(b->single, over_small);
        b->drawn = vm_and_not(b->drawn, over_small);
    }
    if (g == TL_FLOAT) {
        drop_turned(s, b);
    } else if (sink_has_depth(sink_of(s->target, sink))) {
        const vi size = vi_mul(vi_sub(b->extents.x_max, b->extents.x_min), vi_sub(b->extents.y_max, b->extents.y_min)),
                 one = vi_set1(1);
        const vi box = vi_shift_right(vi_sub(size, one), TL_SLIVER_BITS);
        /* box > area * 2^12, as in `setup_plane` */
        const vm sliver = vm_and(b->drawn, vi_gt(box, vi_sub(b->absolute, one)));
        b->single = vm_or(b->single, sliver);
        b->drawn = vm_and_not(b->drawn, sliver);
    }
}

TL_INLINE void draw_each_single(walk_state *s, tl_geometry g, tl_sink sink, vm single, vi id)
{
    if (!vm_any(single))
        return;
    int32_t ids[TL_MAX_LANES];
    vi_store(ids, id);
    for (unsigned lanes = vm_bits(single); lanes && s->bad_row < 0 && !tl_is_given_up(s->window); lanes &= lanes - 1)
        if (g == TL_FLOAT)
            draw_one_float(s, ids[__builtin_ctz(lanes)]);
        else
            draw_one_fixed(s->snapped, ids[__builtin_ctz(lanes)], s->window, s->target, sink);
}

/* Draws the triangles of a queue. */
#define TL_FLUSH_QUEUE(kind)                                                      \
    TL_INLINE void flush_queue_##kind(walk_state *s, tl_geometry g, tl_sink sink) \
    {                                                                             \
        if (sink == TL_SINK_SAMPLES)                                              \
            flush_##kind##_of_samples(s);                                         \
        else                                                                      \
            TL_WALK_CALL(flush_##kind, s, g, sink)                                \
    }
TL_FLUSH_QUEUE(small)
TL_FLUSH_QUEUE(middle)
TL_FLUSH_QUEUE(rows)

/* Triangles that lanes draw, by the size of their boxes: in the order of tl_class, from TL_CLASS_TINY on. */
enum { BOX_TINY, BOX_SMALL, BOX_MIDDLE, BOX_ROWS, N_BOXES };

/* The most columns of a middle box.  TL_FLOAT: TL_NEAR_BAND limits them; several samples: TL_MAX_WORDS does. */
TL_INLINE int middle_cols(const walk_state *s, tl_geometry g, tl_sink sink)
{
    const int most = sink_of(s->target, s->target->sink) == TL_SINK_MASK ? TL_BIT_COLS : TL_BLOCK_COLS;
    return (g == TL_FLOAT || sink == TL_SINK_SAMPLES) && most > TL_MIDDLE_BOX ? TL_MIDDLE_BOX : most;
}

TL_INLINE void sort_boxes(const lane_batch *b, int most_cols, vm *boxes)
{
    const vi longer = vi_max(b->n_cols, b->n_rows);
    const vm over_tiny = vi_gt(longer, vi_set1(2)), over_small = vi_gt(longer, vi_set1(TL_SMALL_BOX));
    const vm over = vm_and(b->drawn, over_small);
    const vm beyond = vm_or(vi_gt(b->n_cols, vi_set1(most_cols)), vi_gt(b->n_rows, vi_set1(TL_MIDDLE_BOX)));
    boxes[BOX_TINY] = vm_and_not(b->drawn, over_tiny);
    boxes[BOX_SMALL] = vm_and(b->drawn, vm_and_not(over_tiny, over_small));
    boxes[BOX_MIDDLE] = vm_and_not(over, beyond);
    boxes[BOX_ROWS] = vm_and(over, beyond);
}

/* TL_FLOAT: fewer tiny boxes than this are queued with the small boxes. */
#define TL_FEW_TINY ((TL_LANES + 3) / 4)

/* Draws tiny boxes at once; queues other boxes until a vector of their size is full. */
TL_INLINE void draw_boxes(walk_state *s, tl_geometry g, tl_sink sink, lane_batch *b, vm *boxes, vi id)
{
    const vm tiny = boxes[BOX_TINY];
    if (g == TL_FLOAT && __builtin_popcount(vm_bits(tiny)) < TL_FEW_TINY)
        boxes[BOX_SMALL] = vm_or(boxes[BOX_SMALL], tiny);
    else if (g == TL_FLOAT)
        draw_tiny_float(s, sink, b, tiny, id);
    else if (vm_any(tiny) && sink == TL_SINK_SAMPLES)
        draw_tiny_of_samples(s, b, tiny);
    else if (vm_any(tiny))
        draw_tiny_fixed(s, sink, b, tiny, id);
    if (vm_any(boxes[BOX_SMALL]) && push(&s->small, g, boxes[BOX_SMALL], b, id))
        flush_queue_small(s, g, sink);
    if (vm_any(boxes[BOX_MIDDLE]) && push(&s->middle, g, boxes[BOX_MIDDLE], b, id))
        flush_queue_middle(s, g, sink);
    if (vm_any(boxes[BOX_ROWS]) && push(&s->rows, g, boxes[BOX_ROWS], b, id))
        flush_queue_rows(s, g, sink);
}

/* Setup and cull of TL_LANES triangles; then draws or queues each by its size. */
TL_INLINE void draw_batch(walk_state *s, tl_geometry g, tl_sink sink, const int32_t *corners, vi id, vm live)
{
    lane_batch b;
    vm boxes[N_BOXES];
    if (!load_batch(s, g, sink, corners, id, live, &b))
        return;
    if (g == TL_FIXED) {
        count_faceless(s->target, sink, vm_and_not(vm_and_not(live, b.single), b.drawn), b.area);
        if (!vm_any(vm_or(b.drawn, b.single)))
            return;
        find_fixed_boxes(s, &b);
    }
    if (s->slice->outside && !s->slice->clusters)
        list_outside(s, &b, id);
    if (g == TL_FIXED)
        count_unseen(s->target, sink, vm_and_not(b.drawn, has_box(&b)), shorter_side(s, &b));
    b.drawn = vm_and(b.drawn, has_box(&b));
    take_out(s, g, sink, &b);
    draw_each_single(s, g, sink, b.single, id);
    if (!vm_any(b.drawn))
        return;
    sort_boxes(&b, middle_cols(s, g, sink), boxes);
    if (sink == TL_SINK_CENSUS)
        count_boxes(s->target->census, boxes, b.n_cols, b.n_rows, b.absolute, s->window->subpixel_bits);
    else
        draw_boxes(s, g, sink, &b, boxes, id);
}

/* Draws the triangles of a slice, or of a cluster. */
TL_INLINE void draw_triangles(walk_state *s, tl_geometry g, tl_sink sink, const tl_slice *part)
{
    const void *vertices = g == TL_FIXED ? (const void *)s->snapped->mesh.vertices : (const void *)s->points->points;
    const size_t n_bytes = g == TL_FIXED ? sizeof(tl_vertex) : (size_t)s->points->stride * sizeof(double);
    const tl_snapped *snapped = s->snapped;
    /* of this batch and of the next: a vector load stalls on numbers that were just stored */
    int32_t corners[2][3 * TL_LANES];
    int is_given_up = 0, turn = 0;
    slice_corners(snapped, part, part->first, corners[0]);
    for (int64_t i = part->first; i < part->end && s->bad_row < 0 && !is_given_up; i += TL_LANES) {
        tl_count_work(s->window, TL_SETUP_PX * TL_LANES);
        is_given_up = tl_is_given_up(s->window);
        const vm live = vm_first(part->end - i);
        const vi id = part->ids ? vi_load_masked(live, part->ids + i) : vi_add(vi_set1((int32_t)i), vi_iota());
        if (TL_LANES > 1 && !part->ids && !part->clusters && i + 5 * TL_LANES <= part->end)
            fetch_rows(vertices, n_bytes, snapped->triangles + 3 * (i + 4 * TL_LANES));
        if (TL_LANES > 1 && g == TL_FIXED && part->ids && i + 9 * TL_LANES <= part->end)
            fetch_listed(vertices, n_bytes, snapped->triangles, part->ids + i);
        slice_corners(snapped, part, i + TL_LANES, corners[!turn]);
        draw_batch(s, g, sink, corners[turn], id, live);
        turn = !turn;
        if (g == TL_FLOAT && __builtin_expect(s->n_slivers > 0, 0))
            draw_slivers(s);
    }
    if (sink == TL_SINK_CENSUS)
        return; /* the queues are empty */
    flush_queue_small(s, g, sink);
    flush_queue_middle(s, g, sink);
    flush_queue_rows(s, g, sink);
}

/* `start_fixed`, for squares and several samples, and for the slices of a picture. */
TL_INLINE void start_slice(walk_state *s, const tl_snapped *snapped, const tl_window *window, const tl_target *target,
                           tl_slice *slice, tl_sink sink)
{
    const int bits = window->subpixel_bits, of_samples = sink_of(target, sink) == TL_SINK_SAMPLES;
    const int32_t reach = of_samples ? sample_reach(target) : 0;
    const extent_rounding round = round_extent(window);
    start_fixed(s, snapped, window, target);
    set_slice(s, slice);
    s->limits.round = (extent_rounding){round.first - reach, round.end + reach};
    if (window->test != TL_TEST_SAMPLE || of_samples)
        s->limits.max_extent = (TL_MAX_BOX_PX - 2) << (bits < 8 ? bits : 8);
    if (slice->clusters)
        s->limits.last_vertex = vi_set1(TL_CLUSTER - 1);
}

/* Draws every triangle of a slice; the window has fewer than 2^31 samples and lies within 2^30 pixels of 0. */
TL_INLINE void draw_batches(const tl_snapped *snapped, const tl_window *window, const tl_target *target,
                            tl_slice *slice, int64_t *bad_row, tl_sink sink)
{
    walk_state s;
    start_slice(&s, snapped, window, target, slice, sink);
    tl_cluster_pass *clusters = slice->clusters;
    cluster_mesh cluster;
    tl_slice part = *slice;
    const int64_t n_parts = clusters ? list_clusters(clusters, window, target) : 1;
    for (int64_t next = 0; next < n_parts && !(next && tl_is_given_up(window)); next++) {
        if (clusters) {
            const tl_cluster *c = clusters->mesh->clusters + clusters->list[next];
            if (clusters->may_be_hidden && is_cluster_hidden(c, clusters->seen, window, target))
                continue;
            part.first = 0, part.end = load_cluster(c, clusters, snapped, slice, &cluster);
            clusters->n_drawn++;
            s.snapped = &cluster.snapped;
        }
        draw_triangles(&s, TL_FIXED, sink, &part);
    }
    if (sink != TL_SINK_CENSUS)
        flush_fragments(target, &s.fragments, s.fragments.n);
    *bad_row = s.bad_row;
}

TL_INLINE void draw_snapped(const tl_snapped *snapped, const tl_window *window, const tl_target *target,
                            tl_slice *slice, int64_t *bad_row, tl_sink sink)
{
    const int is_centre = window->test == TL_TEST_SAMPLE && sink_of(target, sink) != TL_SINK_SAMPLES;
    const int fits_lanes = is_centre || window->subpixel_bits <= 8;
    if (snapped->method == TL_METHOD_AUTO && is_near(window) && fits_lanes) {
        draw_batches(snapped, window, target, slice, bad_row, sink);
        return;
    }
    *bad_row = first_bad_row(snapped->triangles, snapped->n_triangles, snapped->mesh.n_vertices);
    if (*bad_row >= 0)
        return;
    for (int64_t i = 0; i < snapped->n_triangles && !tl_is_given_up(window); i++) {
        tl_count_work(window, TL_SETUP_PX);
        draw_one_fixed(snapped, i, window, target, sink);
    }
}

TL_SINK_COPY(draw_snapped, samples, TL_SINK_SAMPLES,
             (const tl_snapped *snapped, const tl_window *window, const tl_target *target, tl_slice *slice,
              int64_t *bad_row),
             snapped, window, target, slice, bad_row)
TL_LIST_COPIES(draw_snapped,
               (const tl_snapped *snapped, const tl_window *window, const tl_target *target, tl_slice *slice,
                int64_t *bad_row),
               snapped, window, target, slice, bad_row)

/* Runs the code of `draw_snapped` with a sink that counts. */
static int64_t count_classes(const tl_snapped *snapped, const tl_window *window, const tl_target *target,
                             tl_census *census)
{
    tl_target counted = *target;
    tl_slice slice = {.end = snapped->n_triangles};
    int64_t bad_row = -1;
    counted.sink = TL_SINK_CENSUS, counted.census = census;
    draw_snapped(snapped, window, &counted, &slice, &bad_row, TL_SINK_CENSUS);
    return bad_row;
}

/* With vectors: a loop over single numbers took several times as long as the memset of the ids. */
static void clear_depth(float *depth, int64_t n, float value)
{
    int64_t k = 0;
    for (; k + TL_LANES <= n; k += TL_LANES)
        vf_store(depth + k, vf_set1(value));
    vf_store_masked(depth + k, vm_first(n - k), vf_set1(value));
}

/* Clears every sample of the window. */
static void clear(const tl_window *window, const tl_target *target)
{
    const float farthest = target->sink == TL_SINK_FARTHEST ? -INFINITY : INFINITY;
    if (target->sink == TL_SINK_PEEL) {
        clear_layers(window, target);
        return;
    }
    if (target->covered) {
        const int64_t n_bits = target->stride_px * window->height << target->sample_bits;
        memset(target->covered, 0, (size_t)tl_covered_words(n_bits) * sizeof(uint64_t));
    }
    if (target->sink == TL_SINK_MASK || target->sink == TL_SINK_SAMPLES)
        return;
    /* rows without gaps are cleared as one: long fills write cache lines without reading them */
    const int is_whole = target->stride_px == window->width;
    const int64_t n_rows = is_whole ? 1 : window->height, n = is_whole ? window->width * window->height : window->width;
    /* plane by plane: alternating by row took 1.07 to 1.5 times as long on Sapphire Rapids */
    for (int64_t row = 0; row < n_rows; row++)
        memset((int32_t *)target->pixels + row * target->stride_px, target->sink == TL_SINK_COUNT ? 0 : 0xff,
               (size_t)n * sizeof(int32_t));
    for (int64_t row = 0; sink_has_depth(target->sink) && row < n_rows; row++)
        clear_depth(target->depth + row * target->stride_px, n, farthest);
    if (target->bounds)
        clear_depth(target->bounds, tl_segments(target->stride_px) * window->height, farthest);
}

/* Draws the pieces of listed triangles. */
static __attribute__((noinline)) void draw_listed_pieces(walk_state *s, int64_t n_whole, const tl_slice *slice)
{
    const tl_pieces *pieces = s->snapped->mesh.exact->pieces;
    for (int64_t i = slice->first; i < slice->end; i++) {
        int64_t k = first_piece(pieces->source, pieces->n_pieces, slice->ids[i]);
        for (; k < pieces->n_pieces && pieces->source[k] == slice->ids[i]; k++) {
            if (s->bad_row >= 0 || tl_is_given_up(s->window))
                return;
            draw_one_float(s, (int32_t)(n_whole + k));
        }
    }
}

/* Draws every triangle of a slice without snapped vertices; triangles from n_whole on are pieces. */
TL_INLINE void draw_floats(const tl_snapped *mesh, int64_t n_whole, const tl_window *window, const tl_target *target,
                           tl_slice *slice, int64_t *bad_row, tl_sink sink)
{
    const int counts_pieces = target->sink == TL_SINK_COUNT && window->test != TL_TEST_SAMPLE;
    walk_state s;
    tl_slice part = *slice;
    start_float(&s, mesh, window, target);
    set_slice(&s, slice);
    part.end = counts_pieces ? min64(slice->end, n_whole) : slice->end;
    draw_triangles(&s, TL_FLOAT, sink, &part);
    draw_slivers(&s);
    if (slice->ids && mesh->mesh.exact->pieces)
        draw_listed_pieces(&s, n_whole, slice);
    flush_fragments(target, &s.fragments, s.fragments.n);
    if (counts_pieces && s.bad_row < 0)
        count_pieces(&s, max64(slice->first, n_whole), slice->end);
    *bad_row = s.bad_row;
}

TL_LIST_COPIES(draw_floats,
               (const tl_snapped *mesh, int64_t n_whole, const tl_window *window, const tl_target *target,
                tl_slice *slice, int64_t *bad_row),
               mesh, n_whole, window, target, slice, bad_row)

/* The mesh with the triangles that are drawn: clipped triangles collapsed, then all pieces. */
static tl_snapped drawn_mesh(const tl_snapped *snapped)
{
    const tl_exact_points *points = snapped->mesh.exact;
    tl_snapped drawn = *snapped;
    drawn.triangles = points->triangles, drawn.n_triangles = points->n_triangles;
    drawn.mesh.n_vertices = points->n_points;
    drawn.names = points->names ? points->names : snapped->names; /* without names in `points` there are no pieces */
    return drawn;
}

static int64_t draw_exact(const tl_snapped *snapped, const tl_window *band, const tl_target *part, tl_slice *slice)
{
    const tl_snapped drawn = drawn_mesh(snapped);
    const int has_all = !slice->ids && slice->end == snapped->n_triangles;
    tl_slice own = *slice;
    int64_t bad_row = -1;
    own.end = has_all ? drawn.n_triangles : slice->end;
    if (own.first < own.end)
        TL_LIST_CALL(draw_floats, part->sink, &drawn, snapped->n_triangles, band, part, &own, &bad_row)
    slice->n_outside = own.n_outside;
    return bad_row;
}

/* Draws a band of less than 2^31 pixels. */
static int64_t draw_part(const tl_snapped *snapped, const tl_window *window, const tl_target *target, tl_slice *slice)
{
    int64_t bad_row = -1;
    if (snapped->mesh.exact)
        return draw_exact(snapped, window, target, slice);
    if (slice->first >= slice->end && !slice->clusters)
        return bad_row;
    if (target->sink == TL_SINK_SAMPLES)
        draw_snapped_samples(snapped, window, target, slice, &bad_row);
    else
        TL_LIST_CALL(draw_snapped, target->sink, snapped, window, target, slice, &bad_row)
    return bad_row;
}

/* Clears, draws and finishes bands of less than 2^31 pixels. */
static int64_t draw_mesh(const tl_snapped *snapped, const tl_window *window, const tl_target *target, tl_slice *slice)
{
    const int64_t pixel_bytes = target->sink == TL_SINK_MASK ? 1 : 4;
    const int64_t rows_at_once = max64(1, (((int64_t)1 << 31) - 1) / target->stride_px);
    if ((unsigned)target->sink > TL_SINK_PEEL)
        __builtin_trap(); /* not a sink of `draw` */
    for (int64_t row = 0; row < window->height; row += rows_at_once) {
        tl_window band = *window;
        tl_target part = *target;
        band.y_px += row;
        band.height = min64(rows_at_once, window->height - row);
        part.pixels = target->pixels ? (char *)target->pixels + row * target->stride_px * pixel_bytes : NULL;
        part.depth = target->depth ? target->depth + row * target->stride_px : NULL;
        part.n_samples = part.stride_px * (band.height - 1) + band.width;
        part.bounds = target->bounds ? target->bounds + row * tl_segments(target->stride_px) : NULL;
        if (slice->is_first)
            clear(&band, &part);
        const int64_t bad_row = draw_part(snapped, &band, &part, slice);
        if (bad_row >= 0)
            return bad_row;
        if (target->sink == TL_SINK_MASK && slice->is_last)
            expand_covered(&band, &part);
        if (target->sink == TL_SINK_SAMPLES && slice->is_last)
            share_samples(&band, &part);
    }
    return -1;
}

#endif
