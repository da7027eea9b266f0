/* Blend: the pass that blends the colours of triangles into the canvas, one triangle after the other.
 * In: vertex records, triangles and their colours.  Out: pixels.
 *
 * Triangles are drawn in order, from one queue.  Setup and row ends are computed a vector of triangles at a time, as in
 * rows.c; rows are then drawn triangle by triangle.  A triangle that lanes cannot process flushes the queue and is
 * drawn by itself.  Where clip planes cut triangles that are not snapped, every triangle is drawn by itself, and the
 * pieces of a cut triangle in its place.  All bands of rows draw the triangles in the same order, so threads change no
 * bit. */
#ifndef TL_BLEND_C
#define TL_BLEND_C

#include <stddef.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/clip.c"
#include "vertex/exact.h"
#include "vertex/fixed.h"
#include "vertex/snap.c"
#include "raster/single_float.c"
#include "raster/raster.c"
#include "raster/refine.c"
#include "raster/rows.c"
#include "raster/state.h"
#include "raster/triangles_fixed.c"
#include "raster/triangles_float.c"
#include "blend/blend_area.c"
#include "blend/mix.c"
#include "blend/mix.h"
#include "blend/mix_u8.c"

typedef struct {
    walk_state walk; /* its queue `rows` holds triangles that are not drawn yet */
    blend_state mix;
} blend_pass;

/* Steps through the row ends of TL_LANES triangles; returns the lanes with a row end in doubt. */
TL_INLINE vm find_blend_rows(tl_geometry g, lane_edges *e, vi sample, vi n_cols, int n_rows, vi stride,
                             blend_rows *rows)
{
    vm doubted = vm_first(0);
    for (int row = 0; row < n_rows; row++) {
        vi begin, end;
        next_row(g, e, n_cols, &begin, &end, &doubted);
        begin = vi_min(begin, n_cols), end = vi_max(end, vi_set1(0)); /* corners may have changed since the box */
        vi_store(rows->first[row], vi_add(sample, begin));
        vi_store(rows->n[row], vi_sub(end, begin));
        sample = vi_add(sample, stride);
    }
    return doubted;
}

/* Decides the row ends of the lanes in doubt: by lanes where vertices are on the grid, else by the exact sign. */
static __attribute__((noinline)) void refine_blend_rows(walk_state *s, int i, lane_exact *t, vi n_cols, int n_rows,
                                                        int32_t stride, vm doubted, blend_rows *rows)
{
    const box_queue *q = &s->rows;
    int32_t sample[TL_MAX_LANES];
    if (vm_any(vm_and(try_grid(s, t, 0), doubted))) {
        lane_edges e;
        sort_float_edges(s, t, TL_FAR_BAND, &e);
        doubted = vm_and(find_blend_rows(TL_FLOAT, &e, t->sample, n_cols, n_rows, vi_set1(stride), rows), t->live);
    }
    vi_store(sample, t->sample);
    for (unsigned left = vm_bits(doubted); left; left &= left - 1) {
        const int k = __builtin_ctz(left), n = q->size[i + k] >> 16;
        refined_triangle a;
        set_refined(s, q, i, k, t, TL_FAR_BAND, &a);
        for (int row = 0; row < n; row++) {
            int64_t first, end;
            decide_row(&a, row, &first, &end);
            rows->first[row][k] = sample[k] + row * stride + (int32_t)first;
            rows->n[row][k] = (int32_t)(end - first);
        }
    }
}

TL_INLINE void flush_blend_rows(blend_pass *p, tl_geometry g)
{
    walk_state *s = &p->walk;
    blend_state *b = &p->mix;
    box_queue *q = &s->rows;
    const int32_t stride = (int32_t)b->stride;
    const int n = q->n;
    q->n = 0;
    for (int i = 0; i < n; i += TL_LANES) {
        lane_exact t;
        row_lanes r;
        blend_rows rows;
        const int end = lanes_at(i, n), max_rows = most_rows(q, i, n);
        const vi n_cols = vi_and(vi_load(q->size + i), vi_set1(0xffff));
        load_rows(s, g, TL_SINK_BLEND, q, i, n, TL_FAR_BAND, &t, &r);
        const vm doubted = find_blend_rows(g, &r.edges, r.sample, n_cols, max_rows, vi_set1(stride), &rows);
        if (g == TL_FLOAT && __builtin_expect(vm_bits(doubted) & r.live, 0))
            refine_blend_rows(s, i, &t, n_cols, max_rows, stride, vm_and(doubted, t.live), &rows);
        for (int k = 0; k < end; k++) {
            const int64_t id = q->id[i + k];
            if ((g == TL_FLOAT && !(r.live >> k & 1)) || (b->is_flat && !begin_flat(b, id)))
                continue;
            if (!b->is_flat && g == TL_FIXED)
                begin_gouraud_of_mesh(b, id);
            else if (!b->is_flat)
                begin_exact_gouraud(b, id, -1);
            mix_runs(b, &rows.first[0][k], &rows.n[0][k], TL_MAX_LANES, q->size[i + k] >> 16);
        }
    }
}
static __attribute__((noinline)) void flush_blend_fixed(blend_pass *p) { flush_blend_rows(p, TL_FIXED); }
static __attribute__((noinline)) void flush_blend_float(blend_pass *p) { flush_blend_rows(p, TL_FLOAT); }
TL_INLINE void flush_blend(blend_pass *p, tl_geometry g)
{
    if (g == TL_FIXED)
        flush_blend_fixed(p);
    else
        flush_blend_float(p);
}

/* Draws triangle or piece `drawn` of the list by itself, with the colour of triangle `name`; TL_FLOAT. */
static __attribute__((noinline)) void blend_single_float(blend_pass *p, int64_t drawn, int64_t name)
{
    blend_state *b = &p->mix;
    const int64_t n_whole = b->snapped->n_triangles;
    if (b->is_flat && !begin_flat(b, name))
        return;
    if (!b->is_flat)
        begin_exact_gouraud(b, name, drawn < n_whole ? -1 : drawn - n_whole);
    draw_single_float(&p->walk, (int32_t)drawn, TL_SINK_BLEND);
}

/* Setup and cull of TL_LANES triangles, which are drawn after all in the queue. */
TL_INLINE void blend_batch(blend_pass *p, tl_geometry g, const int32_t *corners, vi id, vm live)
{
    walk_state *s = &p->walk;
    lane_batch b;
    if (!load_batch(s, g, TL_SINK_BLEND, corners, id, live, &b))
        return;
    if (g == TL_FIXED)
        find_fixed_boxes(s, &b);
    vm drawn = vm_and(b.drawn, has_box(&b)), single = b.single;
    if (g == TL_FIXED) {
        const vi special = vi_set1(s->limits.special_x); /* relative to a sample it may be the greatest number */
        const vm is_special =
            vm_or(vm_or(vi_eq(b.c.x[0], special), vi_eq(b.c.x[1], special)), vi_eq(b.c.x[2], special));
        single = vm_and(single, vm_or(is_special, has_box(&b)));
    }
    if (TL_LANES == 1) { /* a single lane gains nothing from the queue */
        single = vm_or(single, drawn);
        drawn = vm_and_not(drawn, single);
    }
    if (vm_any(single)) {
        int32_t ids[TL_MAX_LANES];
        vi_store(ids, id);
        for (unsigned lanes = vm_bits(single); lanes && s->bad_row < 0; lanes &= lanes - 1) {
            const int lane = __builtin_ctz(lanes);
            const vm before = vm_first(lane);
            push(&s->rows, g, vm_and(drawn, before), &b, id);
            drawn = vm_and_not(drawn, before);
            flush_blend(p, g);
            if (tl_is_given_up(s->window))
                return;
            if (g == TL_FIXED)
                blend_single_fixed(&p->mix, ids[lane]);
            else
                blend_single_float(p, ids[lane], ids[lane]);
        }
    }
    if (vm_any(drawn) && push(&s->rows, g, drawn, &b, id))
        flush_blend(p, g);
}

/* Draws every triangle; the window has fewer than 2^31 samples and lies within 2^30 pixels of 0. */
TL_INLINE void blend_batches(blend_pass *p, tl_geometry g)
{
    walk_state *s = &p->walk;
    const tl_snapped *snapped = p->mix.snapped;
    const tl_slice all = {.first = 0, .end = snapped->n_triangles};
    int32_t corners[3 * TL_LANES];
    for (int64_t i = 0; i < all.end && s->bad_row < 0 && !tl_is_given_up(s->window); i += TL_LANES) {
        tl_count_work(s->window, TL_SETUP_PX * TL_LANES);
        blend_batch(p, g, slice_corners(snapped, &all, i, corners), vi_add(vi_set1((int32_t)i), vi_iota()),
                    vm_first(all.end - i));
    }
    flush_blend(p, g);
}

/* Draws every triangle by itself, for any method and far windows. */
static void blend_each_fixed(blend_pass *p)
{
    const tl_snapped *snapped = p->mix.snapped;
    const tl_window *window = p->mix.window;
    p->walk.bad_row = first_bad_row(snapped->triangles, snapped->n_triangles, snapped->mesh.n_vertices);
    for (int64_t i = 0; p->walk.bad_row < 0 && i < snapped->n_triangles && !tl_is_given_up(window); i++) {
        tl_count_work(window, TL_SETUP_PX);
        blend_single_fixed(&p->mix, i);
    }
}

/* Draws every triangle by itself, with vertices that are not snapped; the pieces of a clipped triangle in its place. */
static void blend_each_float(blend_pass *p)
{
    walk_state *s = &p->walk;
    const tl_snapped *snapped = p->mix.snapped;
    const tl_pieces *pieces = snapped->mesh.exact->pieces;
    const int64_t n_pieces = pieces ? pieces->n_pieces : 0;
    s->bad_row = first_bad_row(snapped->triangles, snapped->n_triangles, snapped->mesh.n_vertices);
    for (int64_t i = 0, k = 0; i < snapped->n_triangles && s->bad_row < 0 && !tl_is_given_up(s->window); i++) {
        tl_count_work(s->window, TL_SETUP_PX);
        blend_single_float(p, i, i);
        for (; k < n_pieces && pieces->source[k] == i; k++)
            blend_single_float(p, snapped->n_triangles + k, i);
    }
}

static void blend_fixed(blend_pass *p)
{
    start_fixed(&p->walk, p->mix.snapped, p->mix.window, &p->mix.target);
    if (p->mix.snapped->method == TL_METHOD_AUTO && is_near(p->mix.window))
        blend_batches(p, TL_FIXED);
    else
        blend_each_fixed(p);
}

static __attribute__((noinline)) void blend_float(blend_pass *p)
{
    const tl_snapped drawn = drawn_mesh(p->mix.snapped);
    start_float(&p->walk, &drawn, p->mix.window, &p->mix.target);
    if (drawn.mesh.exact->pieces || p->walk.is_far)
        blend_each_float(p);
    else
        blend_batches(p, TL_FLOAT);
}

static tl_mix mix_of(const tl_canvas *canvas)
{
    const int has_alpha = canvas->n_channels == 2 || canvas->n_channels == 4;
    const int is_straight = has_alpha && !canvas->is_premultiplied;
    switch (canvas->blend) {
    case TL_BLEND_REPLACE: return is_straight ? TL_MIX_REPLACE_STRAIGHT : TL_MIX_REPLACE;
    case TL_BLEND_OVER: return is_straight ? TL_MIX_OVER_STRAIGHT : TL_MIX_OVER_PREMULTIPLIED;
    case TL_BLEND_ADD: return TL_MIX_ADD;
    case TL_BLEND_MULTIPLY: return TL_MIX_MULTIPLY;
    case TL_BLEND_MAX: return TL_MIX_MAX;
    default: return TL_MIX_MIN;
    }
}

static void start_blend(blend_state *b, const tl_snapped *snapped, const tl_window *window, const tl_canvas *canvas)
{
    b->snapped = snapped, b->window = window, b->canvas = canvas;
    b->packed = canvas->is_u8 ? canvas->packed ? canvas->packed : canvas->pixels : NULL;
    b->floats = canvas->is_u8 ? NULL : canvas->pixels;
    b->stride = canvas->packed ? window->width : canvas->stride_px;
    b->n_samples = b->stride * (window->height - 1) + window->width;
    b->n_channels = canvas->n_channels, b->is_flat = canvas->is_flat, b->mode = mix_of(canvas);
    b->target = (tl_target){.sink = TL_SINK_BLEND, .pixels = b, .stride_px = b->stride, .n_samples = b->n_samples};
    b->ground = canvas->ground && canvas->is_u8 ? packed_color(canvas->ground, canvas->n_channels) : 0;
    b->n_laid = canvas->ground ? 0 : window->height;
    b->shapes = NULL;
}

/* A window of fewer than 2^31 samples. */
static int64_t blend_window(const tl_snapped *snapped, const tl_window *window, const tl_canvas *canvas)
{
    blend_pass p;
    blend_state *b = &p.mix;
    const int64_t n_channels = canvas->n_channels;
    start_blend(b, snapped, window, canvas);
    if (snapped->mesh.exact || !canvas->is_area)
        lay_ground(b, window->height);
    for (int64_t row = 0; canvas->packed && !canvas->ground && row < window->height; row++)
        pack_u8((const uint8_t *)canvas->pixels + row * canvas->stride_px * n_channels, window->width,
                canvas->n_channels, canvas->packed + row * b->stride);
    p.walk.bad_row = -1;
    if (snapped->mesh.exact)
        blend_float(&p);
    else if (canvas->is_area)
        p.walk.bad_row = blend_areas(b);
    else
        blend_fixed(&p);
    for (int64_t row = 0; canvas->packed && row < window->height; row++)
        unpack_u8(canvas->packed + row * b->stride, window->width, canvas->n_channels,
                  (uint8_t *)canvas->pixels + row * canvas->stride_px * n_channels);
    return p.walk.bad_row;
}

static int64_t blend(const tl_snapped *snapped, const tl_window *window, const tl_canvas *canvas)
{
    const int64_t pixel_bytes = canvas->n_channels * (canvas->is_u8 ? 1 : 4);
    const int64_t fitting = max64(1, (((int64_t)1 << 31) - 1) / canvas->stride_px);
    const int64_t rows_at_once = min64(fitting, canvas->band_rows);
    for (int64_t row = 0; row < window->height; row += rows_at_once) {
        tl_window band = *window;
        tl_canvas part = *canvas;
        band.y_px += row;
        band.height = min64(rows_at_once, window->height - row);
        part.pixels = (char *)canvas->pixels + row * canvas->stride_px * pixel_bytes;
        const int64_t bad_row = blend_window(snapped, &band, &part);
        if (bad_row >= 0)
            return bad_row;
    }
    return -1;
}

#endif
