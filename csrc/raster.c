/* Raster: every triangle of a scene, in order, through setup and a walker to the sink.
 * In: vertex records and triangles.  Out: the target's buffers. */
#include "fixed.h"

#define TL_INT int64_t
#define TL_UINT uint64_t
#define TL_WALK(name) name##_64
static inline void floor_divide_64(int64_t a, int64_t b, int64_t *quotient, int64_t *remainder)
{
    const int64_t q = a / b, r = a % b;
    *quotient = q - (r < 0);
    *remainder = r < 0 ? r + b : r;
}
#include "walk.h"
#undef TL_INT
#undef TL_UINT
#undef TL_WALK

#define TL_INT tl_int128
#define TL_UINT tl_uint128
#define TL_WALK(name) name##_128
static inline void floor_divide_128(tl_int128 a, tl_int128 b, tl_int128 *quotient, tl_int128 *remainder)
{
    const tl_int128 q = a / b, r = a % b;
    *quotient = q - (r < 0);
    *remainder = r < 0 ? r + b : r;
}
#include "walk.h"
#undef TL_INT
#undef TL_UINT
#undef TL_WALK

#include "batch.c"
#include "rows.c"

/* A box at most this wide is walked sample by sample, a wider one by its row ends. */
#define TL_EDGE_MAX_WIDTH 6

/* One triangle by itself: any range, any method. */
TL_INLINE void draw_triangle(const tl_vertex_set *set, const int32_t *corners, int32_t id, const tl_scene *scene,
                             const tl_window *window, const tl_target *target, tl_sink sink)
{
    tl_triangle t;
    const int sign = load_triangle(set, corners, &t);
    if (sign == 0 || (sign > 0 && scene->cull == TL_CULL_BACK) || (sign < 0 && scene->cull == TL_CULL_FRONT))
        return;
    if (!clip_box(&t, window))
        return;
    t.id = id;
    setup_sink(&t, window, sink);
    const int is_auto = scene->method == TL_METHOD_AUTO;
    const int by_edge = scene->method == TL_METHOD_EDGE || (is_auto && t.col1 - t.col0 <= TL_EDGE_MAX_WIDTH);
    if (is_auto && rows_fit(&t) && (!sink_has_depth(sink) || t.has_plane))
        walk_rows(&t, window, target, sink);
    else if (t.is_narrow && by_edge)
        walk_edge_64(&t, window, target, sink);
    else if (t.is_narrow)
        walk_scanline_64(&t, window, target, sink);
    else if (by_edge)
        walk_edge_128(&t, window, target, sink);
    else
        walk_scanline_128(&t, window, target, sink);
}

static inline int is_clipped(const tl_vertex_set *set, const int32_t *corners)
{
    int clipped = 0;
    for (int k = 0; k < 3; k++)
        clipped |= set->vertices[corners[k]].x_fx == TL_SPECIAL && set->vertices[corners[k]].y_fx == TL_CLIPPED;
    return clipped;
}

static tl_vertex_set piece_set(const tl_pieces *p)
{
    return (tl_vertex_set){p->vertices, p->wide, p->inv_w, NULL, p->n_vertices};
}

/* First piece of a triangle, by bisection in the ascending sources. */
static int64_t first_piece(const tl_pieces *p, int64_t id)
{
    int64_t low = 0, high = p->n_pieces;
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (p->source[middle] < id)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Triangle i, or its pieces, by itself. */
TL_INLINE void draw_alone(const tl_scene *scene, int64_t i, const tl_window *window, const tl_target *target, tl_sink sink)
{
    const int32_t *corners = scene->triangles + 3 * i;
    const tl_pieces *pieces = scene->pieces;
    tl_vertex_set set = scene->mesh;
    int64_t piece = 0, end = 1;
    if (is_clipped(&set, corners)) {
        if (!pieces)
            return;
        set = piece_set(pieces);
        piece = first_piece(pieces, i);
        for (end = piece; end < pieces->n_pieces && pieces->source[end] == i;)
            end++;
        corners = pieces->triangles + 3 * piece;
    }
    for (; piece < end; piece++, corners += 3)
        draw_triangle(&set, corners, (int32_t)i, scene, window, target, sink);
}

TL_SINK_COPIES(draw_alone, (const tl_scene *scene, int64_t i, const tl_window *window, const tl_target *target), scene, i, window,
               target)


/* Whether the 3 * TL_LANES indices of a vector of triangles hold one outside [0, last_vertex]. */
TL_INLINE int has_bad_index(const int32_t *corners, vi last_vertex)
{
    const vm bad01 = vm_or(vi_gt_unsigned(vi_load(corners), last_vertex), vi_gt_unsigned(vi_load(corners + TL_LANES), last_vertex));
    return vm_any(vm_or(bad01, vi_gt_unsigned(vi_load(corners + 2 * TL_LANES), last_vertex)));
}

TL_INLINE vi first_centre_lanes(vi x_fx, int bits)
{
    const int round = bits ? (1 << (bits - 1)) - 1 : 0; /* the first centre at or right of x_fx, as first_centre */
    return vi_shift_right(vi_add(x_fx, vi_set1(round)), bits);
}

/* Setup and cull of the triangles [i, i + TL_LANES). */
TL_INLINE void draw_batch(batch_state *s, tl_sink sink, int64_t i, const int32_t *corners, vm live)
{
    const int bits = s->window->subpixel_bits, either_turn = s->scene->cull == TL_CULL_NONE;
    const batch_limits *limits = &s->limits;
    const vi zero = vi_set1(0);
    for (int k = 0; k < 3 * TL_LANES; k += 16) /* 5 % of a million-triangle mesh */
        __builtin_prefetch(corners + 12 * 48 + k);
    if (has_bad_index(corners, limits->last_vertex)) {
        s->bad_row = i;
        return;
    }
    lane_corners c;
    load_corners(s, corners, &c);
    const vi x_min = vi_min(vi_min(c.x[0], c.x[1]), c.x[2]), x_max = vi_max(vi_max(c.x[0], c.x[1]), c.x[2]);
    const vi y_min = vi_min(vi_min(c.y[0], c.y[1]), c.y[2]), y_max = vi_max(vi_max(c.y[0], c.y[1]), c.y[2]);
    const vi width = vi_sub(x_max, x_min), height = vi_sub(y_max, y_min);
    /* a special vertex has x = INT32_MIN: its triangle is too wide, or special throughout */
    vm alone = vm_or(vi_gt_unsigned(width, vi_set1(limits->max_extent)), vi_gt_unsigned(height, vi_set1(limits->max_extent)));
    alone = vm_and(live, vm_or(alone, vi_eq(x_min, vi_set1(TL_SPECIAL))));
    const vi area = area_lanes(&c), absolute = either_turn ? vi_max(area, vi_sub(zero, area)) : area;
    vm drawn = vm_and_not(vm_and(live, vi_gt(absolute, zero)), alone);
    const vi col = vi_max(first_centre_lanes(x_min, bits), vi_set1(limits->left));
    const vi row = vi_max(first_centre_lanes(y_min, bits), vi_set1(limits->top));
    const vi n_cols = vi_sub(vi_min(first_centre_lanes(x_max, bits), vi_set1(limits->right)), col);
    const vi n_rows = vi_sub(vi_min(first_centre_lanes(y_max, bits), vi_set1(limits->bottom)), row);
    drawn = vm_and(drawn, vi_gt(vi_min(n_cols, n_rows), zero));
    if (sink_has_depth(sink)) {
        const vi box = vi_shift_right(vi_sub(vi_mul(width, height), vi_set1(1)), TL_SLIVER_BITS);
        const vm sliver = vm_and(drawn, vi_gt(box, vi_sub(absolute, vi_set1(1)))); /* box > area * 2^12, as setup_plane */
        alone = vm_or(alone, sliver);
        drawn = vm_and_not(drawn, sliver);
    }
    for (unsigned lanes = vm_bits(alone); lanes; lanes &= lanes - 1)
        TL_SINK_CALL(draw_alone, sink, s->scene, i + __builtin_ctz(lanes), s->window, s->target)
    if (!vm_any(drawn))
        return;
    const vi id = vi_add(vi_set1((int32_t)i), vi_iota()), longer = vi_max(n_cols, n_rows);
    const vm over_tiny = vi_gt(longer, vi_set1(2)), over_small = vi_gt(longer, vi_set1(TL_SMALL_BOX));
    const vm tiny = vm_and_not(drawn, over_tiny), small = vm_and(drawn, vm_and_not(over_tiny, over_small)),
             rows = vm_and(drawn, over_small);
    if (vm_any(tiny)) {
        lane_triangles t;
        vd z[3];
        place_triangles(s, sink, &c, col, row, &t, z);
        draw_tiny(s, sink, &t, z, tiny, n_cols, n_rows, id);
    }
    if (vm_any(small)) {
        push(&s->small, small, col, row, n_cols, n_rows, id);
        if (s->small.n > TL_QUEUE - TL_LANES)
            TL_SINK_CALL(flush_small, sink, s)
    }
    if (vm_any(rows)) {
        push(&s->rows, rows, col, row, n_cols, n_rows, id);
        if (s->rows.n > TL_QUEUE - TL_LANES)
            TL_SINK_CALL(flush_rows, sink, s)
    }
}

/* Every triangle of a scene; the window has fewer than 2^31 samples and lies within 2^30 pixels of 0. */
TL_INLINE void draw_batches(const tl_scene *scene, const tl_window *window, const tl_target *target, int64_t *bad_row,
                            tl_sink sink)
{
    batch_state s;
    s.scene = scene, s.window = window, s.target = target, s.bad_row = -1;
    s.small.n = s.rows.n = s.fragments.n = 0;
    memset(s.fragments.sample, 0, sizeof s.fragments.sample); /* what is prefetched behind the end of the list */
    const int bits = window->subpixel_bits, is_back = scene->cull == TL_CULL_BACK;
    const int64_t farthest = (int64_t)1 << 30;
    s.limits = (batch_limits){
        .left = (int32_t)window->x_px,
        .top = (int32_t)window->y_px,
        .right = (int32_t)min64(window->x_px + window->width, farthest),
        .bottom = (int32_t)min64(window->y_px + window->height, farthest),
        .max_extent = TL_MAX_BOX_PX << (bits < 8 ? bits : 8),
        .second = is_back ? 2 : 1,
        .third = is_back ? 1 : 2,
        .last_vertex = vi_set1((int32_t)(scene->mesh.n_vertices - 1)),
    };
    int32_t tail[3 * TL_LANES] = {0};
    const int64_t n_whole = scene->n_triangles / TL_LANES * TL_LANES;
    memcpy(tail, scene->triangles + 3 * n_whole, sizeof(int32_t) * 3 * (size_t)(scene->n_triangles - n_whole));
    for (int64_t i = 0; i < scene->n_triangles && s.bad_row < 0; i += TL_LANES)
        draw_batch(&s, sink, i, i < n_whole ? scene->triangles + 3 * i : tail, vm_first(scene->n_triangles - i));
    TL_SINK_CALL(flush_small, sink, &s)
    TL_SINK_CALL(flush_rows, sink, &s)
    flush_fragments(target, sink, &s.fragments, s.fragments.n);
    *bad_row = s.bad_row;
}

TL_INLINE void draw_scene(const tl_scene *scene, const tl_window *window, const tl_target *target, int64_t *bad_row, tl_sink sink)
{
    const int64_t farthest = (int64_t)1 << 30;
    const int is_near = window->x_px > -farthest && window->x_px < farthest && window->y_px > -farthest && window->y_px < farthest;
    if (scene->method == TL_METHOD_AUTO && is_near) {
        draw_batches(scene, window, target, bad_row, sink);
        return;
    }
    *bad_row = first_bad_row(scene->triangles, scene->n_triangles, scene->mesh.n_vertices);
    if (*bad_row >= 0)
        return;
    for (int64_t i = 0; i < scene->n_triangles; i++)
        TL_SINK_CALL(draw_alone, sink, scene, i, window, target)
}

TL_SINK_COPIES(draw_scene, (const tl_scene *scene, const tl_window *window, const tl_target *target, int64_t *bad_row), scene, window,
               target, bad_row)

/* What every sample of the window starts as. */
static void clear(const tl_window *window, const tl_target *target)
{
    const int is_count = target->sink == TL_SINK_MASK || target->sink == TL_SINK_COUNT;
    const float farthest = target->sink == TL_SINK_FARTHEST ? -INFINITY : INFINITY;
    const int64_t pixel_bytes = target->sink == TL_SINK_MASK ? 1 : 4;
    for (int64_t row = 0; row < window->height; row++) {
        const int64_t at = row * target->stride_px;
        memset((char *)target->pixels + at * pixel_bytes, is_count ? 0 : 0xff, (size_t)(window->width * pixel_bytes));
        for (int64_t col = 0; sink_has_depth(target->sink) && col < window->width; col++)
            target->depth[at + col] = farthest;
    }
}

static int64_t draw(const tl_scene *scene, const tl_window *window, const tl_target *target)
{
    const int64_t pixel_bytes = target->sink == TL_SINK_MASK ? 1 : 4;
    const int64_t rows_at_once = max64(1, (((int64_t)1 << 31) - 1) / target->stride_px);
    for (int64_t row = 0; row < window->height; row += rows_at_once) {
        tl_window band = *window;
        tl_target part = *target;
        band.y_px += row;
        band.height = min64(rows_at_once, window->height - row);
        part.pixels = (char *)target->pixels + row * target->stride_px * pixel_bytes;
        part.depth = target->depth ? target->depth + row * target->stride_px : NULL;
        int64_t bad_row = -1;
        clear(&band, &part);
        if (scene->n_triangles == 0)
            continue;
        TL_SINK_CALL(draw_scene, target->sink, scene, &band, &part, &bad_row)
        if (bad_row >= 0)
            return bad_row;
    }
    return -1;
}
