/* Fills a picture with the flat colours of a few large triangles, row by row, with one sample a pixel or several.
 * In: triangles of a snapped mesh, their colours, the colour behind them.  Out: every pixel, written once.
 *
 * A run of pixels has a key: the labels of its samples side by side, 0 for the background.  The colour of a key is the
 * mean of resolve.c, and is cached: edges repeat few keys. */
#ifndef TL_FILL_SHAPES_C
#define TL_FILL_SHAPES_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "vertex/snap.c"
#include "large_shapes/row_runs.c"
#include "large_shapes/row_spans.c"
#include "pixels/resolve.c"

#define TL_KEPT_COLORS_BITS 6

typedef struct {
    const tl_canvas *canvas;
    const tl_transfer *transfer;
    int sample_bits, label_bits, pixel_bytes;
    unsigned n_kept;
    uint64_t each_label; /* 1 in the label of every sample */
    uint64_t keys[1 << TL_KEPT_COLORS_BITS];
    char colors[1 << TL_KEPT_COLORS_BITS][16];
} shape_colors;

TL_INLINE const char *color_of_label(const shape_colors *f, uint64_t label)
{
    const char *colors = f->canvas->colors, *ground = (const char *)f->canvas->ground;
    return label ? colors + (int64_t)(label - 1) * f->pixel_bytes : ground;
}

static __attribute__((noinline)) void mix_color(const shape_colors *f, uint64_t key, char *color)
{
    const uint64_t label = (1ull << (f->label_bits & 63)) - 1;
    const void *own[TL_MAX_SAMPLES];
    for (int s = 0; s < 1 << f->sample_bits; s++)
        own[s] = color_of_label(f, key >> (s * f->label_bits) & label);
    mean_pixel(own, f->sample_bits, f->canvas->n_channels, f->canvas->is_u8, f->transfer, color);
}

/* The colour of the pixels of a key. */
TL_INLINE const char *color_of_key(shape_colors *f, uint64_t key)
{
    if (f->sample_bits == 0)
        return color_of_label(f, key);
    const uint64_t first = key & ((1ull << (f->label_bits & 63)) - 1);
    if (key == first * f->each_label)
        return color_of_label(f, first);
    const int place = (int)(key * 0x9e3779b97f4a7c15u >> (64 - TL_KEPT_COLORS_BITS));
    for (int k = 0; k < 4; k++)
        if (f->keys[place ^ k] == key)
            return f->colors[place ^ k];
    const int at = place ^ (f->n_kept++ & 3);
    mix_color(f, key, f->colors[at]);
    f->keys[at] = key;
    return f->colors[at];
}

/* Colours the rows of a band from pixel `at` on, by their listed spans. */
TL_INLINE void color_band(shape_colors *f, const span_table *t, int64_t n_rows, int64_t at, open_run *run,
                          int pixel_bytes)
{
    const uint64_t label = (1ull << (f->label_bits & 63)) - 1;
    for (int64_t row = 0; row < n_rows; row++, at += f->canvas->stride_px) {
        const column_span *spans = t->spans + row * t->n_in_row;
        row_runs r;
        start_row(&r, t->width, 0);
        for (int64_t slot = 0; slot < t->n_slots; slot++) {
            if (spans[slot].first >= spans[slot].end)
                continue;
            const int shift = (int)(slot & ((1 << f->sample_bits) - 1)) * f->label_bits;
            lay_span(&r, spans[slot].first, spans[slot].end, KEY_REPLACE, label << shift,
                     (t->triangles[slot] + 1ull) << shift);
        }
        for (int k = 0; k < r.n; k++)
            add_pixels(run, at + r.col[k], at + r.col[k + 1], color_of_key(f, r.key[k]), pixel_bytes);
    }
}

static void fill_rows_of_shapes(shape_colors *f, const tl_snapped *snapped, const tl_window *window,
                                const int32_t *samples_fx)
{
    const int64_t stride = f->canvas->stride_px;
    span_table t;
    open_run run = start_pixels(f->canvas->pixels, window->width, window->height, stride);
    start_span_table(&t, snapped, 1 << f->sample_bits, window->width);
    for (int64_t row = 0; row < window->height && !tl_is_given_up(window); row += t.n_rows) {
        tl_window band = *window;
        band.y_px += row;
        band.height = min64(t.n_rows, window->height - row);
        list_row_spans(snapped, &band, f->sample_bits ? samples_fx : NULL, 1 << f->sample_bits, &t);
        if (f->pixel_bytes == 4)
            color_band(f, &t, band.height, row * stride, &run, 4);
        else
            color_band(f, &t, band.height, row * stride, &run, f->pixel_bytes);
    }
    close_run(&run, f->pixel_bytes);
}

static int64_t fill_large_shapes(const tl_snapped *snapped, const tl_window *window, const tl_canvas *canvas,
                                 const int32_t *samples_fx, int sample_bits, const tl_transfer *transfer)
{
    const int64_t bad_row = first_bad_row(snapped->triangles, snapped->n_triangles, snapped->mesh.n_vertices);
    shape_colors f = {.canvas = canvas, .transfer = transfer, .sample_bits = sample_bits};
    if (bad_row >= 0)
        return bad_row;
    f.label_bits = tl_shape_label_bits(sample_bits);
    f.pixel_bytes = canvas->n_channels * (canvas->is_u8 ? 1 : 4);
    for (int s = 0; s < 1 << sample_bits; s++)
        f.each_label |= 1ull << (s * f.label_bits);
    memset(f.keys, 0xff, sizeof f.keys); /* no key: no label has all bits set */
    fill_rows_of_shapes(&f, snapped, window, samples_fx);
    return -1;
}

#endif
