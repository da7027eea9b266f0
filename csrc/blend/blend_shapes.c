/* Blend of a few large flat triangles over one colour, row by row of the picture.
 * In: triangles and their colours, the colour behind them.  Out: every pixel, written once.
 *
 * The walkers of large triangles draw a band of rows as runs (mix_shapes.c), which are then written. */
#ifndef TL_BLEND_SHAPES_C
#define TL_BLEND_SHAPES_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "vertex/snap.c"
#include "large_shapes/row_runs.c"
#include "blend/blend_rows.c"
#include "blend/mix.c"
#include "blend/mix.h"
#include "blend/mix_shapes.c"
#include "blend/mix_u8.c"

/* Writes the rows of a band, from pixel `at` on. */
TL_INLINE void put_band(blend_state *b, int64_t n_rows, int64_t at, open_run *run, int pixel_bytes)
{
    shape_state *f = b->shapes;
    for (int64_t row = 0; row < n_rows; row++, at += f->canvas->stride_px) {
        const row_runs *r = f->rows + row;
        for (int k = 0; k < r->n; k++) {
            const int64_t first = at + r->col[k], end = at + r->col[k + 1];
            if (r->key[k] != TL_KEY_BUFFERED) {
                add_pixels(run, first, end, color_of_mix(f, r->key[k])->value, pixel_bytes);
                continue;
            }
            close_run(run, pixel_bytes);
            run->first = run->end = end;
            if (!f->is_in_place)
                unpack_u8(b->packed + row * b->stride + r->col[k], end - first, b->n_channels,
                          (uint8_t *)run->pixels + first * pixel_bytes);
        }
    }
}

/* `b` is set for the window, except for its target. */
static int64_t blend_large_shapes(blend_state *b)
{
    const tl_canvas *canvas = b->canvas;
    const tl_window *window = b->window;
    const tl_snapped *snapped = b->snapped;
    const int64_t bad_row = first_bad_row(snapped->triangles, snapped->n_triangles, snapped->mesh.n_vertices);
    if (bad_row >= 0)
        return bad_row;
    shape_state f;
    f.canvas = canvas, f.pixel_bytes = canvas->n_channels * (canvas->is_u8 ? 1 : 4);
    f.one = *b, f.one.stride = f.one.n_samples = 1;
    for (int k = 0; k < 1 << TL_MIXED_KEYS_BITS; k++)
        f.colors[k].key = TL_KEY_BUFFERED; /* no key of a colour */
    tl_window band = *window;
    open_run run = start_pixels(canvas->pixels, window->width, window->height, canvas->stride_px);
    f.is_in_place = !canvas->packed;
    if (f.is_in_place)
        run.n_px = 0; /* no pixel is written twice: buffered pixels are in the picture already */
    b->shapes = &f, b->window = &band, b->packed = canvas->packed;
    b->stride = f.is_in_place ? canvas->stride_px : window->width;
    b->n_laid = INT64_MAX;
    for (int64_t row = 0; row < window->height && !tl_is_given_up(window); row += TL_BLENDED_ROWS) {
        band.y_px = window->y_px + row;
        band.height = min64(TL_BLENDED_ROWS, window->height - row);
        if (f.is_in_place) {
            b->floats = (float *)canvas->pixels + row * canvas->stride_px * canvas->n_channels;
            b->packed = (int32_t *)canvas->pixels + row * canvas->stride_px;
        }
        b->n_samples = b->stride * (band.height - 1) + band.width;
        b->target.stride_px = b->stride, b->target.n_samples = b->n_samples;
        for (int64_t k = 0; k < band.height; k++)
            start_row(f.rows + k, band.width, 0);
        for (f.id = 0; f.id < snapped->n_triangles; f.id++) {
            tl_count_work(window, TL_SETUP_PX);
            if (canvas->is_area)
                blend_area_single(b, f.id);
            else
                blend_single_fixed(b, f.id);
        }
        if (f.pixel_bytes == 4)
            put_band(b, band.height, row * canvas->stride_px, &run, 4);
        else
            put_band(b, band.height, row * canvas->stride_px, &run, f.pixel_bytes);
    }
    close_run(&run, f.pixel_bytes);
    return -1;
}

#endif
