/* Raster: every triangle of a scene, a vector of them at a time, through setup and cull to the code for its size.
 * In: vertex records and triangles.  Out: the target's buffers. */
#ifndef TL_RASTER_C
#define TL_RASTER_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "clusters.h"
#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "vertex/snap.c"
#include "clusters/cluster_view.c"
#include "raster/alone.c"
#include "raster/batch.c"
#include "raster/census.c"
#include "raster/covered.c"
#include "raster/peel.c"
#include "raster/rows.c"
#include "raster/sampled.c"
#include "raster/sampled_alone.c"
#include "raster/setup.c"
#include "raster/sink.c"

/* Whether the 3 * TL_LANES indices of a vector of triangles hold one outside [0, last_vertex]. */
TL_INLINE int has_bad_index(const int32_t *corners, vi last_vertex)
{
    const vm bad01 = vm_or(vi_gt_unsigned(vi_load(corners), last_vertex), vi_gt_unsigned(vi_load(corners + TL_LANES), last_vertex));
    return vm_any(vm_or(bad01, vi_gt_unsigned(vi_load(corners + 2 * TL_LANES), last_vertex)));
}

/* As round_extent tells. */
TL_INLINE vi extent_pixels(vi x_fx, int32_t round, int bits) { return vi_shift_right(vi_add(x_fx, vi_set1(round)), bits); }

/* Lists triangles for the passes that draw the rest of the picture. */
TL_INLINE void list_others(tl_share *share, vm m, vi id)
{
    vi_compress(share->others + share->n_others, m, id);
    share->n_others += __builtin_popcount(vm_bits(m));
}

TL_INLINE void draw_one(const tl_scene *scene, int64_t i, const tl_window *window, const tl_target *target, tl_sink sink)
{
    if (sink == TL_SINK_CENSUS)
        draw_alone(scene, i, window, target, sink);
    else if (sink == TL_SINK_SAMPLES)
        draw_alone_each_sample(scene, i, window, target);
    else
        TL_SINK_CALL(draw_alone, sink, scene, i, window, target)
}

/* Setup and cull of TL_LANES triangles. */
TL_INLINE void draw_batch(batch_state *s, tl_sink sink, const int32_t *corners, vi id, vm live)
{
    const int bits = s->window->subpixel_bits, either_turn = s->scene->cull == TL_CULL_NONE;
    const batch_limits *limits = &s->limits;
    const vi zero = vi_set1(0);
    for (int k = 0; k < 3 * TL_LANES; k += 16) /* 5 % of a million-triangle mesh */
        __builtin_prefetch(corners + 12 * 48 + k);
    if (has_bad_index(corners, limits->last_vertex)) {
        int32_t ids[TL_MAX_LANES];
        vi_store(ids, id);
        s->bad_row = ids[0];
        return;
    }
    lane_corners c;
    load_corners(s, corners, &c);
    const vi x_min = vi_min(vi_min(c.x[0], c.x[1]), c.x[2]), x_max = vi_max(vi_max(c.x[0], c.x[1]), c.x[2]);
    const vi y_min = vi_min(vi_min(c.y[0], c.y[1]), c.y[2]), y_max = vi_max(vi_max(c.y[0], c.y[1]), c.y[2]);
    const vi width = vi_sub(x_max, x_min), height = vi_sub(y_max, y_min);
    /* a special vertex has x = INT32_MIN: its triangle is too wide, or special throughout */
    vm alone = vm_or(vi_gt_unsigned(width, vi_set1(limits->max_extent)), vi_gt_unsigned(height, vi_set1(limits->max_extent)));
    alone = vm_and(live, vm_or(alone, vi_eq(x_min, vi_set1(limits->special_x))));
    const vi area = area_lanes(&c), absolute = either_turn ? vi_max(area, vi_sub(zero, area)) : area;
    vm drawn = vm_and_not(vm_and(live, vi_gt(absolute, zero)), alone);
    if (sink == TL_SINK_CENSUS)
        count_faceless(s->target->census, vm_and_not(vm_and_not(live, alone), drawn), area);
    if (!vm_any(vm_or(drawn, alone)))
        return;
    const vi col = vi_max(extent_pixels(x_min, limits->round.first, bits), vi_set1(limits->left));
    const vi n_cols = vi_sub(vi_min(extent_pixels(x_max, limits->round.end, bits), vi_set1(limits->right)), col);
    const vi top = extent_pixels(y_min, limits->round.first, bits), bottom = extent_pixels(y_max, limits->round.end, bits), row = vi_max(top, vi_set1(limits->top));
    const vi n_rows = vi_sub(vi_min(bottom, vi_set1(limits->bottom)), row);
    if (s->share->others && !s->share->clusters) {
        const vi first = vi_max(top, vi_set1(limits->picture_top)), end = vi_min(bottom, vi_set1(limits->picture_bottom));
        const vm is_seen = vm_and(drawn, vm_and(vi_gt(n_cols, zero), vi_gt(end, first)));
        const vm is_beyond = vm_or(vi_gt(row, first), vi_gt(end, vi_set1(limits->bottom)));
        list_others(s->share, vm_or(alone, vm_and(is_seen, is_beyond)), id);
    }
    if (sink == TL_SINK_CENSUS) {
        const vi all_cols = vi_sub(extent_pixels(x_max, limits->round.end, bits), extent_pixels(x_min, limits->round.first, bits));
        count_unseen(s->target->census, vm_and_not(drawn, vi_gt(vi_min(n_cols, n_rows), zero)), vi_min(all_cols, vi_sub(bottom, top)));
    }
    drawn = vm_and(drawn, vi_gt(vi_min(n_cols, n_rows), zero));
    if (TL_LANES == 1) { /* one lane gains nothing from the rows of rows.c */
        const vm over_small = vm_and(drawn, vi_gt(vi_max(n_cols, n_rows), vi_set1(TL_SMALL_BOX)));
        alone = vm_or(alone, over_small);
        drawn = vm_and_not(drawn, over_small);
    }
    if (sink_has_depth(sink_of(s->target, sink))) {
        const vi box = vi_shift_right(vi_sub(vi_mul(width, height), vi_set1(1)), TL_SLIVER_BITS);
        const vm sliver = vm_and(drawn, vi_gt(box, vi_sub(absolute, vi_set1(1)))); /* box > area * 2^12, as setup_plane */
        alone = vm_or(alone, sliver);
        drawn = vm_and_not(drawn, sliver);
    }
    if (vm_any(alone)) {
        int32_t ids[TL_MAX_LANES];
        vi_store(ids, id);
        for (unsigned lanes = vm_bits(alone); lanes; lanes &= lanes - 1)
            draw_one(s->scene, ids[__builtin_ctz(lanes)], s->window, s->target, sink);
    }
    if (!vm_any(drawn))
        return;
    const vi longer = vi_max(n_cols, n_rows);
    const vm over_tiny = vi_gt(longer, vi_set1(2)), over_small = vi_gt(longer, vi_set1(TL_SMALL_BOX));
    const vm tiny = vm_and_not(drawn, over_tiny), small = vm_and(drawn, vm_and_not(over_tiny, over_small)),
             over = vm_and(drawn, over_small);
    const vm beyond = vm_or(vi_gt(n_cols, vi_set1(TL_LANES)), vi_gt(n_rows, vi_set1(TL_MIDDLE_BOX)));
    const vm middle = vm_and_not(over, beyond), rows = vm_and(over, beyond);
    if (sink == TL_SINK_CENSUS) {
        const vm classes[4] = {tiny, small, middle, rows};
        count_boxes(s->target->census, classes, n_cols, n_rows, absolute, bits);
        return;
    }
    if (vm_any(tiny)) {
        lane_triangles t;
        vd z[3];
        place_triangles(s, sink, &c, col, row, &t, z);
        draw_tiny(s, sink, &t, z, tiny, n_cols, n_rows, names_of(s->scene, tiny, id));
    }
    if (vm_any(small)) {
        push(&s->small, small, col, row, n_cols, n_rows, id);
        if (s->small.n > TL_QUEUE - TL_LANES)
            TL_SINK_CALL(flush_small, sink, s)
    }
    if (vm_any(middle)) {
        push(&s->middle, middle, col, row, n_cols, n_rows, id);
        if (s->middle.n > TL_QUEUE - TL_LANES)
            TL_SINK_CALL(flush_middle, sink, s)
    }
    if (vm_any(rows)) {
        push(&s->rows, rows, col, row, n_cols, n_rows, id);
        if (s->rows.n > TL_QUEUE - TL_LANES)
            TL_SINK_CALL(flush_rows, sink, s)
    }
}

/* The corners of the triangles [i, i + TL_LANES) of a share, behind the end zeros; in `buffer` unless they lie there already. */
TL_INLINE const int32_t *share_corners(const tl_scene *scene, const tl_share *share, int64_t i, int32_t *buffer)
{
    if (!share->ids && i + TL_LANES <= share->end)
        return scene->triangles + 3 * i;
    for (int k = 0; k < TL_LANES; k++) {
        const int64_t id = i + k >= share->end ? -1 : share->ids ? share->ids[i + k] : i + k;
        if (id >= 0)
            memcpy(buffer + 3 * k, scene->triangles + 3 * id, 3 * sizeof *buffer);
        else
            memset(buffer + 3 * k, 0, 3 * sizeof *buffer);
    }
    return buffer;
}

/* Every triangle of a share; the window has fewer than 2^31 samples and lies within 2^30 pixels of 0. */
TL_INLINE void draw_batches(const tl_scene *scene, const tl_window *window, const tl_target *target, tl_share *share, int64_t *bad_row,
                            tl_sink sink)
{
    batch_state s;
    s.scene = scene, s.window = window, s.target = target, s.share = share, s.bad_row = -1;
    s.small.n = s.middle.n = s.rows.n = s.fragments.n = 0;
    memset(s.fragments.sample, 0, sizeof s.fragments.sample); /* what is prefetched behind the end of the list */
    const int bits = window->subpixel_bits, is_back = scene->cull == TL_CULL_BACK;
    const int of_samples = sink_of(target, sink) == TL_SINK_SAMPLES, is_centre = window->test == TL_TEST_SAMPLE && !of_samples;
    const int32_t reach = of_samples ? sample_reach(target) : 0;
    const extent_rounding round = round_extent(window);
    const int64_t farthest = (int64_t)1 << 30;
    const tl_window *picture = share->others && !share->clusters ? share->picture : window;
    s.limits = (batch_limits){
        .left = (int32_t)window->x_px,
        .top = (int32_t)window->y_px,
        .right = (int32_t)min64(window->x_px + window->width, farthest),
        .bottom = (int32_t)min64(window->y_px + window->height, farthest),
        .picture_top = (int32_t)picture->y_px,
        .picture_bottom = (int32_t)min64(picture->y_px + picture->height, farthest),
        .max_extent = (TL_MAX_BOX_PX - (is_centre ? 0 : 2)) << (bits < 8 ? bits : 8),
        .round = {round.first - reach, round.end + reach},
        .special_x = (int32_t)((uint32_t)TL_SPECIAL - (uint32_t)scene->mesh.sample_x_fx),
        .second = is_back ? 2 : 1,
        .third = is_back ? 1 : 2,
        .last_vertex = vi_set1((int32_t)((share->clusters ? TL_CLUSTER : scene->mesh.n_vertices) - 1)),
    };
    tl_cluster_pass *clusters = share->clusters;
    cluster_scene cluster;
    tl_share part = *share;
    const int64_t n_parts = clusters ? list_clusters(clusters, window, target) : 1;
    for (int64_t next = 0; next < n_parts; next++) {
        if (clusters) {
            const tl_cluster *c = clusters->mesh->clusters + clusters->list[next];
            if (clusters->may_be_hidden && is_cluster_hidden(c, clusters->seen, window, target))
                continue;
            part.first = 0, part.end = load_cluster(c, clusters, scene, share, &cluster);
            clusters->n_drawn++;
            s.scene = &cluster.scene;
        }
        for (int64_t i = part.first; i < part.end && s.bad_row < 0; i += TL_LANES) {
            int32_t corners[3 * TL_LANES];
            const vm live = vm_first(part.end - i);
            const vi id = part.ids ? vi_load_masked(live, part.ids + i) : vi_add(vi_set1((int32_t)i), vi_iota());
            draw_batch(&s, sink, share_corners(s.scene, &part, i, corners), id, live);
        }
        TL_SINK_CALL(flush_small, sink, &s)
        TL_SINK_CALL(flush_middle, sink, &s)
        TL_SINK_CALL(flush_rows, sink, &s)
    }
    flush_fragments(target, sink, &s.fragments, s.fragments.n);
    *bad_row = s.bad_row;
}

TL_INLINE void draw_scene(const tl_scene *scene, const tl_window *window, const tl_target *target, tl_share *share, int64_t *bad_row,
                          tl_sink sink)
{
    const int64_t farthest = (int64_t)1 << 30;
    const int is_near = window->x_px > -farthest && window->x_px < farthest && window->y_px > -farthest && window->y_px < farthest;
    const int is_centre = window->test == TL_TEST_SAMPLE && sink_of(target, sink) != TL_SINK_SAMPLES;
    const int fits_lanes = is_centre || window->subpixel_bits <= 8;
    if (scene->method == TL_METHOD_AUTO && is_near && fits_lanes) {
        draw_batches(scene, window, target, share, bad_row, sink);
        return;
    }
    *bad_row = first_bad_row(scene->triangles, scene->n_triangles, scene->mesh.n_vertices);
    if (*bad_row >= 0)
        return;
    for (int64_t i = 0; i < scene->n_triangles; i++)
        draw_one(scene, i, window, target, sink);
}

TL_SINK_COPIES(draw_scene, (const tl_scene *scene, const tl_window *window, const tl_target *target, tl_share *share, int64_t *bad_row),
               scene, window, target, share, bad_row)

/* Counts the triangles of a scene by what draw_scene does with them: in its own code. */
static int64_t count_classes(const tl_scene *scene, const tl_window *window, const tl_target *target, tl_census *census)
{
    tl_target counted = *target;
    tl_share share = {.end = scene->n_triangles};
    int64_t bad_row = -1;
    counted.sink = TL_SINK_CENSUS, counted.census = census;
    draw_scene(scene, window, &counted, &share, &bad_row, TL_SINK_CENSUS);
    return bad_row;
}

/* In vectors: a loop over single numbers took several times as long as the memset of the ids. */
static void clear_depth(float *depth, int64_t n, float value)
{
    int64_t k = 0;
    for (; k + TL_LANES <= n; k += TL_LANES)
        vf_store(depth + k, vf_set1(value));
    vf_store_masked(depth + k, vm_first(n - k), vf_set1(value));
}

/* What every sample of the window starts as. */
static void clear(const tl_window *window, const tl_target *target)
{
    const float farthest = target->sink == TL_SINK_FARTHEST ? -INFINITY : INFINITY;
    if (target->sink == TL_SINK_PEEL) {
        clear_layers(window, target);
        return;
    }
    if (target->sink == TL_SINK_MASK || target->sink == TL_SINK_SAMPLES) {
        const int64_t n_bits = target->stride_px * window->height << target->sample_bits;
        memset(target->covered, 0, (size_t)tl_covered_words(n_bits) * sizeof(uint64_t));
        return;
    }
    for (int64_t row = 0; row < window->height; row++) {
        const int64_t at = row * target->stride_px;
        memset((int32_t *)target->pixels + at, target->sink == TL_SINK_COUNT ? 0 : 0xff, (size_t)window->width * sizeof(int32_t));
        if (sink_has_depth(target->sink))
            clear_depth(target->depth + at, window->width, farthest);
    }
}

static int64_t draw(const tl_scene *scene, const tl_window *window, const tl_target *target, tl_share *share)
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
        if (share->first < share->end || share->clusters)
            TL_SINK_CALL(draw_scene, target->sink, scene, &band, &part, share, &bad_row)
        if (bad_row >= 0)
            return bad_row;
        if (target->sink == TL_SINK_MASK && share->is_last)
            expand_covered(&band, &part);
        if (target->sink == TL_SINK_SAMPLES && share->is_last)
            share_samples(&band, &part);
    }
    return -1;
}

#endif
