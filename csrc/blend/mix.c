/* Mix: the colour of the current triangle, and runs of pixels that it covers.
 * In: a triangle, runs of samples that it covers.  Out: pixels of the canvas, by mix_u8.c or mix_f32.c.
 * Based on: T. Porter, T. Duff, Compositing Digital Images, 1984 (over, plus; alpha multiplied by coverage); H.
 * Gouraud, Continuous Shading of Curved Surfaces, 1971. */
#ifndef TL_MIX_C
#define TL_MIX_C

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/clip.c"
#include "vertex/exact.h"
#include "vertex/fixed.h"
#include "vertex/setup.c"
#include "exact/pieces.c"
#include "exact/sign.c"
#include "sink/pixel_runs.c"
#include "sink/sink.c"
#include "raster/single_fixed.c"
#include "pixels/paint.c"
#include "pixels/weights_one.c"
#include "blend/mix.h"
#include "blend/mix_f32.c"
#include "blend/mix_u8.c"

/* Starts triangle `id`.  Returns 0 if its colour changes no pixel. */
TL_INLINE int begin_flat(blend_state *b, int64_t id)
{
    const int n_channels = b->n_channels;
    b->whole_mode = b->mode == TL_MIX_REPLACE_STRAIGHT ? TL_MIX_REPLACE : b->mode;
    if (!b->canvas->is_u8) {
        const float *color = (const float *)b->canvas->colors + id * n_channels;
        for (int k = 0; k < n_channels; k++)
            b->pattern[k] = color[k];
        for (int k = n_channels; k < TL_LANES + n_channels - 1; k++)
            b->pattern[k] = b->pattern[k - n_channels];
        return 1;
    }
    b->color = packed_color((const uint8_t *)b->canvas->colors + id * n_channels, n_channels);
    const int alpha = b->color >> 24 & 255;
    const int is_over = b->mode == TL_MIX_OVER_STRAIGHT || b->mode == TL_MIX_OVER_PREMULTIPLIED;
    if (is_over && alpha == 255)
        b->whole_mode = TL_MIX_REPLACE;
    return alpha > 0 || b->mode != TL_MIX_OVER_STRAIGHT;
}

/* Starts a triangle of `set`, or a piece of triangle `id`, with colours of its vertices. */
static void begin_gouraud(blend_state *b, int64_t id, const tl_vertex_set *set, const int32_t *corners, int is_piece)
{
    b->whole_mode = b->mode == TL_MIX_REPLACE_STRAIGHT ? TL_MIX_REPLACE : b->mode;
    b->id = id;
    b->resolve.exact = NULL;
    load_triangle(set, corners, &b->resolve.triangle);
    for (int k = 0; k < 3; k++)
        b->resolve.piece[k] =
            is_piece ? b->snapped->pieces->weights + 3 * (int64_t)b->resolve.triangle.corner[k] : NULL;
}

/* Starts a triangle of the mesh that no plane cuts, with colours of its vertices. */
static void begin_gouraud_of_mesh(blend_state *b, int64_t id)
{
    int32_t corners[3];
    read_corners(b->snapped, id, corners);
    begin_gouraud(b, id, &b->snapped->mesh, corners, 0);
}

/* Starts a triangle of the mesh, or a piece of it, with colours of its vertices, which are not snapped. */
static void begin_exact_gouraud(blend_state *b, int64_t id, int64_t piece)
{
    const tl_exact_points *points = b->snapped->mesh.exact;
    resolve_state *s = &b->resolve;
    int32_t corners[3];
    read_corners(b->snapped, id, corners);
    b->whole_mode = b->mode == TL_MIX_REPLACE_STRAIGHT ? TL_MIX_REPLACE : b->mode;
    b->id = id;
    s->exact = &b->snapped->mesh;
    for (int k = 0; k < 3; k++) {
        const int32_t at = piece < 0 ? -1 : points->pieces->triangles[3 * piece + k];
        s->triangle.corner[k] = corners[k];
        s->points[k] = piece < 0 ? point_of(points, corners[k]) : piece_point(points->pieces, at);
        s->piece[k] = piece < 0 ? NULL : points->pieces->weights + 3 * (int64_t)at;
    }
}

/* Sets the colours at the centres of n pixels of a row that the triangle covers partly: where a centre lies outside,
 * weights below 0 count as 0. */
static void color_partly_covered(blend_state *b, int64_t row, int64_t col, int n, void *out)
{
    const tl_canvas *canvas = b->canvas;
    const int bits = b->window->subpixel_bits, n_channels = b->n_channels;
    tl_triangle *t = &b->resolve.triangle;
    double w1[TL_CHUNK], w2[TL_CHUNK];
    t->row0 = row, t->col0 = col;
    setup_weights(t, b->window);
    /* samples beside the triangle exceed the box that `setup_weights` assumes */
    t->weights_exact &= fabs(t->w1_col) + fabs(t->w1_row) < 0x1p50 && fabs(t->w2_col) + fabs(t->w2_row) < 0x1p50;
    weights_at(t, b->window, row, col, n, w1, w2);
    for (int k = 0; k < n; k++) {
        const double w0 = t->w_sum - w1[k] - w2[k], p0 = w0 > 0.0 ? w0 : 0.0, p1 = w1[k] > 0.0 ? w1[k] : 0.0;
        const double p2 = w2[k] > 0.0 ? w2[k] : 0.0;
        const int is_inside = w0 >= 0.0 && w1[k] >= 0.0 && w2[k] >= 0.0;
        const double sum = p0 + p1 + p2;
        for (int c = 0; c < n_channels; c++) {
            const int64_t at[3] = {(int64_t)t->corner[0] * n_channels + c, (int64_t)t->corner[1] * n_channels + c,
                                   (int64_t)t->corner[2] * n_channels + c};
            const uint8_t *u8 = canvas->colors;
            const float *f32 = canvas->colors;
            double v[3];
            for (int j = 0; j < 3; j++)
                v[j] = canvas->is_u8 ? (double)u8[at[j]] : (double)f32[at[j]];
            const double d1 = v[1] - v[0], d2 = v[2] - v[0];
            const double value = is_inside ? v[0] + (w1[k] * (d1 / t->w_sum) + w2[k] * (d2 / t->w_sum))
                                           : (p0 * v[0] + p1 * v[1] + p2 * v[2]) / sum;
            if (!canvas->is_u8)
                ((float *)out)[k * n_channels + c] = (float)value;
            else if (is_inside)
                ((uint8_t *)out)[k * n_channels + c] =
                    round_color(&b->resolve, col + k + b->window->x_px, row + b->window->y_px, bits, (int)v[0], (int)d1,
                                (int)d2, value);
            else
                ((uint8_t *)out)[k * n_channels + c] = (uint8_t)rint(value);
        }
    }
}

/* Loads into `resolve` the piece of the current triangle at a pixel's centre, or nearest to it by the least of its
 * weights. */
static void find_piece(blend_state *b, int64_t x_px, int64_t y_px)
{
    const tl_pieces *p = b->snapped->pieces;
    const tl_vertex_set set = piece_set(p, &b->snapped->mesh);
    resolve_state best = b->resolve;
    double best_weight = -INFINITY;
    for (int64_t i = first_piece(p->source, p->n_pieces, b->id); i < p->n_pieces && p->source[i] == b->id; i++) {
        if (load_triangle(&set, p->triangles + 3 * i, &b->resolve.triangle) == 0)
            continue;
        const tl_triangle *t = &b->resolve.triangle;
        const double sum = i128_to_f64(weight_sum(t));
        double least = INFINITY;
        for (int k = 0; k < 3; k++) {
            const int next = k == 2 ? 0 : k + 1;
            const tl_int128 edge = doubled_edge(t, k, next, x_px, y_px, b->window->subpixel_bits);
            least = fmin(least, i128_to_f64(edge) / sum);
        }
        if (least <= best_weight)
            continue;
        best_weight = least;
        for (int k = 0; k < 3; k++)
            b->resolve.piece[k] = p->weights + 3 * (int64_t)t->corner[k];
        best = b->resolve;
    }
    b->resolve = best;
}

/* Sets `source` to the colours of n <= TL_CHUNK pixels from `at` on. */
static __attribute__((noinline)) void color_run(blend_state *b, int64_t at, int n)
{
    const tl_canvas *canvas = b->canvas;
    const int64_t row = at / b->stride, col = at % b->stride;
    uint8_t bytes[4 * TL_CHUNK];
    void *out = canvas->is_u8 ? (void *)bytes : (void *)b->source_f32;
    const int pixel_bytes = b->n_channels * (canvas->is_u8 ? 1 : 4);
    if (b->resolve.piece[0]) {
        int32_t corners[3];
        read_corners(b->snapped, b->id, corners);
        for (int k = 0; k < n; k++) {
            const int64_t x_px = col + k + b->window->x_px, y_px = row + b->window->y_px;
            if (canvas->is_area)
                find_piece(b, x_px, y_px);
            paint_piece(&b->resolve, corners, x_px, y_px, b->window->subpixel_bits, canvas->colors, b->n_channels,
                        canvas->is_u8, (char *)out + k * pixel_bytes);
        }
    } else if (canvas->is_area) {
        color_partly_covered(b, row, col, n, out);
    } else {
        paint_run(&b->resolve, b->window, row, col, n, canvas->colors, b->n_channels, canvas->is_u8, out);
    }
    for (int k = 0; canvas->is_u8 && k < n; k++)
        b->source[k] = packed_color(bytes + b->n_channels * k, b->n_channels);
}

static __attribute__((noinline)) void mix_runs_any_u8(blend_state *b, const int32_t *first, const int32_t *n, int step,
                                                      int n_rows)
{
    TL_MIX_CALL(mix_runs_u8, b->whole_mode, b, first, n, step, n_rows)
}

static __attribute__((noinline)) void mix_runs_any_f32(blend_state *b, const int32_t *first, const int32_t *n, int step,
                                                       int n_rows)
{
    TL_MIX_CALL(mix_runs_f32, b->whole_mode, b, first, n, step, n_rows)
}

static __attribute__((noinline)) void mix_source(blend_state *b, int64_t at, int n)
{
    if (b->canvas->is_u8) {
        TL_MIX_CALL(mix_source_u8, b->whole_mode, b, at, n)
    } else {
        TL_MIX_CALL(mix_source_f32, b->whole_mode, b, at, n)
    }
}

/* Mixes runs of pixels that the current triangle covers: n[k * step] from first[k * step] on, none where n <= 0. */
static void mix_runs(blend_state *b, const int32_t *first, const int32_t *n, int step, int n_rows)
{
    if (b->is_flat && b->canvas->is_u8) {
        mix_runs_any_u8(b, first, n, step, n_rows);
        return;
    }
    if (b->is_flat) {
        mix_runs_any_f32(b, first, n, step, n_rows);
        return;
    }
    for (int k = 0; k < n_rows; k++)
        for (int32_t i = 0; i < n[k * step]; i += TL_CHUNK) {
            const int n_here = (int)min64(n[k * step] - i, TL_CHUNK);
            color_run(b, (int64_t)(uint32_t)first[k * step] + i, n_here);
            mix_source(b, (int64_t)(uint32_t)first[k * step] + i, n_here);
        }
}

/* Mixes a run of n pixels. */
static void mix_pixels(blend_state *b, int64_t at, int64_t n)
{
    /* mostly long runs: 1.6 times as fast at 300 px */
    if (b->is_flat && b->canvas->is_u8 && b->whole_mode == TL_MIX_REPLACE) {
        put_words(b->packed + at, n, b->color, 0);
        return;
    }
    mix_runs(b, &(int32_t){(int32_t)at}, &(int32_t){(int32_t)n}, 1, 1);
}

static __attribute__((noinline)) void walk_blended(const blend_state *b, const tl_vertex_set *set,
                                                   const int32_t *corners, int64_t id, const tl_window *window)
{
    draw_triangle(set, corners, (int32_t)id, b->snapped, window, &b->target, TL_SINK_BLEND);
}

/* Blends triangle i, or its pieces, by itself. */
static __attribute__((noinline)) void blend_single_fixed(blend_state *b, int64_t i)
{
    int32_t own[3];
    const triangle_parts parts = parts_of(b->snapped, i, own);
    if (!parts.n || (b->is_flat && !begin_flat(b, i)))
        return;
    for (int k = 0; k < parts.n; k++) {
        const int32_t *corners = parts.corners + 3 * k;
        if (!b->is_flat)
            begin_gouraud(b, i, &parts.set, corners, parts.is_cut);
        walk_blended(b, &parts.set, corners, i, b->window);
    }
}

#endif
