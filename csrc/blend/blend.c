/* Blend: the pass that puts the colours of triangles into the canvas, one triangle after the other.
 * In: vertex records, triangles and their colours.  Out: pixels.
 *
 * Nothing is drawn out of order: one queue of triangles, whose setup and row ends are computed a vector of triangles at
 * a time, as in rows.c, and whose rows are then drawn triangle by triangle.  What 32-bit lanes cannot take empties the
 * queue and is drawn by itself.  Bands of rows see the same triangles in the same order, so threads cannot change a
 * bit. */
#ifndef TL_BLEND_C
#define TL_BLEND_C

#include <stddef.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/clip.c"
#include "vertex/fixed.h"
#include "vertex/snap.c"
#include "raster/alone.c"
#include "raster/batch.c"
#include "raster/rows.c"
#include "blend/blend_area.c"
#include "blend/blend_exact.c"
#include "blend/blend_few.c"
#include "blend/blend_queue.c"
#include "blend/mix.c"
#include "blend/mix.h"
#include "blend/mix_u8.c"

typedef struct {
    batch_state batch; /* its queue `rows` holds what waits */
    blend_state mix;
} blend_pass;

static __attribute__((noinline)) void flush_blend(blend_pass *p)
{
    flush_blend_rows((walk_state){.fixed = &p->batch}, TL_FIXED, &p->mix);
}

/* Setup and cull of TL_LANES triangles, which come after all that wait. */
TL_INLINE void blend_batch(blend_pass *p, const int32_t *corners, vi id, vm live)
{
    batch_state *s = &p->batch;
    lane_batch b;
    if (!load_batch(s, corners, id, live, &b))
        return;
    find_boxes(s, &b);
    const vi special = vi_set1(s->limits.special_x); /* of a sample it may be the greatest number, not the least */
    const vm is_special = vm_or(vm_or(vi_eq(b.c.x[0], special), vi_eq(b.c.x[1], special)), vi_eq(b.c.x[2], special));
    vm drawn = vm_and(b.drawn, has_box(&b)), alone = vm_and(b.alone, vm_or(is_special, has_box(&b)));
    if (TL_LANES == 1) { /* one lane gains nothing from the rows above */
        alone = vm_or(alone, drawn);
        drawn = vm_and_not(drawn, alone);
    }
    if (vm_any(alone)) {
        int32_t ids[TL_MAX_LANES];
        vi_store(ids, id);
        for (unsigned lanes = vm_bits(alone); lanes; lanes &= lanes - 1) {
            const int lane = __builtin_ctz(lanes);
            const vm before = vm_first(lane);
            push(&s->rows, vm_and(drawn, before), b.col, b.row, b.n_cols, b.n_rows, id);
            drawn = vm_and_not(drawn, before);
            flush_blend(p);
            if (tl_is_given_up(p->mix.window))
                return;
            blend_alone(&p->mix, ids[lane]);
        }
    }
    if (vm_any(drawn)) {
        push(&s->rows, drawn, b.col, b.row, b.n_cols, b.n_rows, id);
        if (s->rows.n > TL_QUEUE - TL_LANES)
            flush_blend(p);
    }
}

/* Every triangle; the window has fewer than 2^31 samples and lies within 2^30 pixels of 0. */
static int64_t blend_batches(blend_pass *p)
{
    batch_state *s = &p->batch;
    const tl_snapped *snapped = s->snapped;
    const tl_share all = {.first = 0, .end = snapped->n_triangles};
    int32_t corners[3 * TL_LANES];
    for (int64_t i = 0; i < all.end && s->bad_row < 0 && !tl_is_given_up(p->mix.window); i += TL_LANES) {
        tl_count_work(p->mix.window, TL_SETUP_PX * TL_LANES);
        blend_batch(p, share_corners(snapped, &all, i, corners), vi_add(vi_set1((int32_t)i), vi_iota()),
                    vm_first(all.end - i));
    }
    flush_blend(p);
    return s->bad_row;
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

/* A window of fewer than 2^31 samples. */
static int64_t blend_window(const tl_snapped *snapped, const tl_window *window, const tl_canvas *canvas)
{
    blend_pass p;
    blend_state *b = &p.mix;
    const int64_t n_channels = canvas->n_channels;
    b->snapped = snapped, b->window = window, b->canvas = canvas;
    b->packed = canvas->is_u8 ? canvas->packed ? canvas->packed : canvas->pixels : NULL;
    b->floats = canvas->is_u8 ? NULL : canvas->pixels;
    b->stride = canvas->packed || canvas->is_few ? window->width : canvas->stride_px;
    b->n_samples = b->stride * (window->height - 1) + window->width;
    b->n_channels = canvas->n_channels, b->is_flat = canvas->is_flat, b->mode = mix_of(canvas);
    b->target = (tl_target){.sink = TL_SINK_BLEND, .pixels = b, .stride_px = b->stride, .n_samples = b->n_samples};
    b->ground = canvas->ground && canvas->is_u8 ? packed_color(canvas->ground, canvas->n_channels) : 0;
    b->n_laid = canvas->ground ? 0 : window->height;
    b->few = NULL;
    if (canvas->is_few)
        return blend_few(b);
    if (snapped->mesh.exact || !canvas->is_area)
        lay_ground(b, window->height);
    for (int64_t row = 0; canvas->packed && !canvas->ground && row < window->height; row++)
        pack_u8((const uint8_t *)canvas->pixels + row * canvas->stride_px * n_channels, window->width,
                canvas->n_channels, canvas->packed + row * b->stride);
    int64_t bad_row = -1;
    if (snapped->mesh.exact) {
        bad_row = blend_exact(b);
    } else if (canvas->is_area) {
        bad_row = blend_areas(b);
    } else if (snapped->method == TL_METHOD_AUTO && is_near(window)) {
        start_batch(&p.batch, snapped, window, &b->target);
        bad_row = blend_batches(&p);
    } else {
        bad_row = first_bad_row(snapped->triangles, snapped->n_triangles, snapped->mesh.n_vertices);
        for (int64_t i = 0; bad_row < 0 && i < snapped->n_triangles && !tl_is_given_up(window); i++) {
            tl_count_work(window, TL_SETUP_PX);
            blend_alone(b, i);
        }
    }
    for (int64_t row = 0; canvas->packed && row < window->height; row++)
        unpack_u8(canvas->packed + row * b->stride, window->width, canvas->n_channels,
                  (uint8_t *)canvas->pixels + row * canvas->stride_px * n_channels);
    return bad_row;
}

static int64_t blend(const tl_snapped *snapped, const tl_window *window, const tl_canvas *canvas)
{
    const int64_t pixel_bytes = canvas->n_channels * (canvas->is_u8 ? 1 : 4);
    const int64_t fitting = max64(1, (((int64_t)1 << 31) - 1) / canvas->stride_px);
    const int64_t rows_at_once = canvas->is_few ? window->height : min64(fitting, canvas->band_rows);
    for (int64_t row = 0; row < window->height; row += rows_at_once) {
        tl_window band = *window;
        tl_canvas part = *canvas;
        band.y_px += row;
        band.height = min64(rows_at_once, window->height - row);
        part.pixels = (char *)canvas->pixels + row * canvas->stride_px * pixel_bytes;
        part.packed = canvas->packed ? canvas->packed + row * window->width : NULL;
        const int64_t bad_row = blend_window(snapped, &band, &part);
        if (bad_row >= 0)
            return bad_row;
    }
    return -1;
}

#endif
