/* Fill: a few large flat triangles over one colour, written row by row.
 * In: triangles of a snapped mesh and their colours, the colour behind them.  Out: every pixel, written once.
 *
 * Walkers only list the span of each triangle, and of each of its samples, in each row of a band.  The spans of a row
 * become runs of pixels with one key, and each run is written with the colour of its key.  With several samples a key
 * is the labels of all samples, side by side, and its colour their mean: label 0 is the ground, i + 1 triangle i.  With
 * one sample it has a bit for each triangle that is blended there, in their order.  A picture has few keys: an edge
 * shows a few of them over and over, so their colours are kept. */
#ifndef TL_FILL_SHAPES_C
#define TL_FILL_SHAPES_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/clip.c"
#include "vertex/fixed.h"
#include "vertex/snap.c"
#include "sink/pixel_runs.c"
#include "pixels/resolve.c"
#include "blend/blend.c"
#include "blend/mix.c"
#include "blend/mix.h"
#include "blend/mix_u8.c"

#define TL_KEPT_COLORS_BITS 6

/* The covered columns [first, end) of a row, none where they are equal. */
typedef struct {
    int32_t first, end;
} column_span;

/* Runs of a row: run k is [col[k], col[k + 1]). */
typedef struct {
    int n;
    int32_t col[2 * TL_SHAPE_SLOTS + 2];
    uint64_t key[2 * TL_SHAPE_SLOTS + 2];
} row_runs;

typedef struct shape_state {
    blend_state *mix; /* of a picture of one pixel */
    const tl_transfer *transfer;
    int sample_bits, label_bits, pixel_bytes;
    uint64_t each_label; /* 1 in the label of every sample */
    /* The spans of a band: those of a row side by side, a slot for each triangle or piece and sample.  Where a slot
     * covers, its bits `cleared` of the key are cleared, and its bits `set` are set. */
    column_span spans[TL_SHAPE_SPANS];
    uint64_t cleared[TL_SHAPE_SLOTS], set[TL_SHAPE_SLOTS];
    int64_t n_in_row, n_slots, n_rows, width;
    column_span *next; /* of the slot that is listed, in the row that begins at sample row_at */
    int64_t row_at;
    unsigned n_kept;
    uint64_t keys[1 << TL_KEPT_COLORS_BITS];
    char colors[1 << TL_KEPT_COLORS_BITS][16];
} shape_state;

/* ---- spans ------------------------------------------------------------------------------------------------------- */

/* TL_SINK_BLEND of shapes.  Walkers go down row by row, and a row of a triangle is one span. */
static void note_span(shape_state *f, int64_t at, int64_t n)
{
    while (at >= f->row_at + f->width)
        f->row_at += f->width, f->next += f->n_in_row;
    *f->next = (column_span){(int32_t)(at - f->row_at), (int32_t)(at - f->row_at + n)};
}

/* TL_SINK_BLEND: pixels of the triangle at hand. */
static void mix_run(struct blend_state *b, int64_t at, int64_t n)
{
    if (b->shapes)
        note_span(b->shapes, at, n);
    else
        mix_pixels(b, at, n);
}

/* Lists triangle i, or all its pieces, from a slot on; returns the slot behind them. */
static __attribute__((noinline)) int64_t list_triangle(shape_state *f, int64_t i, int64_t slot, const tl_window *band,
                                                       const int32_t *samples_fx)
{
    blend_state *b = f->mix;
    const uint64_t label = (1ull << (f->label_bits & 63)) - 1;
    int32_t own[3];
    triangle_parts parts = parts_of(b->snapped, i, own);
    if (!begin_flat(b, i))
        return slot;
    for (int part = 0; part < parts.n; part++)
        for (int s = 0; s < 1 << f->sample_bits; s++, slot++) {
            if (f->sample_bits) {
                parts.set.sample_x_fx = samples_fx[2 * s], parts.set.sample_y_fx = samples_fx[2 * s + 1];
                f->cleared[slot] = label << s * f->label_bits, f->set[slot] = (i + 1ull) << s * f->label_bits;
            } else {
                f->cleared[slot] = b->whole_mode == TL_MIX_REPLACE ? ~0ull : 0, f->set[slot] = 1ull << i;
            }
            f->next = f->spans + slot, f->row_at = 0;
            walk_blended(b, &parts.set, parts.corners + 3 * part, i, band);
        }
    return slot;
}

/* Lists the spans of a band of at most f->n_rows rows. */
static void list_band(shape_state *f, const tl_window *band, const int32_t *samples_fx)
{
    int64_t slot = 0;
    memset(f->spans, 0, sizeof *f->spans * (size_t)(f->n_in_row * band->height));
    for (int64_t i = 0; i < f->mix->snapped->n_triangles && !tl_is_given_up(band); i++) {
        tl_count_work(band, TL_SETUP_PX);
        slot = list_triangle(f, i, slot, band, samples_fx);
    }
    f->n_slots = slot;
}

/* ---- runs -------------------------------------------------------------------------------------------------------- */

/* Cuts run k in two at a column inside of it. */
TL_INLINE void cut_run(row_runs *r, int k, int32_t col)
{
    uint64_t key = r->key[k];
    r->n++;
    for (int i = k + 1; i <= r->n; i++) { /* no memmove: few, and just written */
        const int32_t next_col = r->col[i];
        const uint64_t next_key = r->key[i];
        r->col[i] = col, r->key[i] = key;
        col = next_col, key = next_key;
    }
}

/* Changes the keys of the pixels of a span. */
TL_INLINE void lay_span(row_runs *r, int32_t first, int32_t end, uint64_t cleared, uint64_t set)
{
    int k = 0;
    if (r->n == 1) { /* the row's first span */
        const uint64_t key = r->key[0];
        const int32_t width = r->col[1];
        k = first > 0;
        r->col[k] = first, r->key[k] = (key & ~cleared) | set;
        r->col[k + 1] = end, r->key[k + 1] = key;
        r->n = k + 1 + (end < width);
        r->col[r->n] = width;
        return;
    }
    while (r->col[k + 1] <= first)
        k++;
    if (r->col[k] < first)
        cut_run(r, k++, first);
    for (; k < r->n && r->col[k] < end; k++) {
        if (r->col[k + 1] > end)
            cut_run(r, k, end);
        r->key[k] = (r->key[k] & ~cleared) | set;
    }
}

/* ---- colours ----------------------------------------------------------------------------------------------------- */

TL_INLINE const char *color_of_label(const shape_state *f, uint64_t label)
{
    const tl_canvas *canvas = f->mix->canvas;
    return label ? (const char *)canvas->colors + (int64_t)(label - 1) * f->pixel_bytes : (const char *)canvas->ground;
}

static void mean_of_key(const shape_state *f, uint64_t key, char *color)
{
    const tl_canvas *canvas = f->mix->canvas;
    const uint64_t label = (1ull << (f->label_bits & 63)) - 1;
    const void *own[TL_MAX_SAMPLES];
    for (int s = 0; s < 1 << f->sample_bits; s++)
        own[s] = color_of_label(f, key >> (s * f->label_bits) & label);
    mean_pixel(own, f->sample_bits, canvas->n_channels, canvas->is_u8, f->transfer, color);
}

/* Blends the triangles of a key over the ground, one pixel. */
static void mix_key(const shape_state *f, uint64_t key, char *color)
{
    blend_state *b = f->mix;
    const tl_canvas *canvas = b->canvas;
    int32_t packed[TL_MAX_LANES + 1] = {b->ground};
    float floats[4 * (TL_MAX_LANES + 1)] = {0};
    if (!canvas->is_u8)
        memcpy(floats, canvas->ground, (size_t)f->pixel_bytes);
    b->packed = packed, b->floats = floats;
    for (uint64_t bits = key; bits; bits &= bits - 1)
        if (begin_flat(b, __builtin_ctzll(bits)))
            mix_pixels(b, 0, 1);
    if (!canvas->is_u8)
        memcpy(color, floats, (size_t)f->pixel_bytes);
    else if (canvas->n_channels == 4)
        memcpy(color, packed, 4);
    else
        unpack_u8(packed, 1, canvas->n_channels, (uint8_t *)color);
}

static __attribute__((noinline)) void keep_color(shape_state *f, uint64_t key, int at)
{
    f->keys[at] = key;
    if (f->sample_bits)
        mean_of_key(f, key, f->colors[at]);
    else
        mix_key(f, key, f->colors[at]);
}

/* The colour of the pixels of a key. */
TL_INLINE const char *color_of_key(shape_state *f, uint64_t key)
{
    const uint64_t first = key & ((1ull << (f->label_bits & 63)) - 1);
    if (f->sample_bits && key == first * f->each_label)
        return color_of_label(f, first);
    const int place = (int)(key * 0x9e3779b97f4a7c15u >> (64 - TL_KEPT_COLORS_BITS));
    for (int k = 0; k < 4; k++)
        if (f->keys[place ^ k] == key)
            return f->colors[place ^ k];
    const int at = place ^ (f->n_kept++ & 3);
    keep_color(f, key, at);
    return f->colors[at];
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

/* The rows of a band from pixel `at` on; their spans are listed. */
TL_INLINE void color_band(shape_state *f, int64_t n_rows, int64_t at, open_run *run, int pixel_bytes)
{
    for (int64_t row = 0; row < n_rows; row++, at += f->mix->canvas->stride_px) {
        const column_span *spans = f->spans + row * f->n_in_row;
        row_runs r;
        r.n = 1, r.col[0] = 0, r.col[1] = (int32_t)f->width, r.key[0] = 0;
        for (int64_t slot = 0; slot < f->n_slots; slot++)
            if (spans[slot].first < spans[slot].end)
                lay_span(&r, spans[slot].first, spans[slot].end, f->cleared[slot], f->set[slot]);
        for (int k = 0; k < r.n; k++)
            add_pixels(run, at + r.col[k], at + r.col[k + 1], color_of_key(f, r.key[k]), pixel_bytes);
    }
}

static void fill_shape_rows(shape_state *f, const tl_window *window, const int32_t *samples_fx)
{
    const tl_canvas *canvas = f->mix->canvas;
    open_run run = start_pixels(canvas->pixels, window->width, window->height, canvas->stride_px);
    for (int64_t row = 0; row < window->height && !tl_is_given_up(window); row += f->n_rows) {
        tl_window band = *window;
        band.y_px += row;
        band.height = min64(f->n_rows, window->height - row);
        list_band(f, &band, samples_fx);
        if (f->pixel_bytes == 4)
            color_band(f, band.height, row * canvas->stride_px, &run, 4);
        else
            color_band(f, band.height, row * canvas->stride_px, &run, f->pixel_bytes);
    }
    close_run(&run, f->pixel_bytes);
}

static int64_t fill_large_shapes(const tl_snapped *snapped, const tl_window *window, const tl_canvas *canvas,
                                 const int32_t *samples_fx, int sample_bits, const tl_transfer *transfer)
{
    const int64_t n_pieces = snapped->pieces ? snapped->pieces->n_pieces : 0;
    const int64_t bad_row = first_bad_row(snapped->triangles, snapped->n_triangles, snapped->mesh.n_vertices);
    blend_state b;
    shape_state f;
    if (bad_row >= 0)
        return bad_row;
    start_blend(&b, snapped, window, canvas);
    b.shapes = &f, b.stride = b.n_samples = 1;
    b.target.stride_px = window->width;
    f.mix = &b, f.transfer = transfer, f.sample_bits = sample_bits, f.label_bits = 64 >> sample_bits;
    f.pixel_bytes = canvas->n_channels * (canvas->is_u8 ? 1 : 4);
    f.each_label = 0, f.n_kept = 0, f.width = window->width;
    for (int s = 0; s < 1 << sample_bits; s++)
        f.each_label |= 1ull << (s * f.label_bits);
    memset(f.keys, 0xff, sizeof f.keys); /* no key has all bits set: there are fewer triangles */
    /* as many rows as stay in the first-level cache, or as are worth setting all triangles up again */
    f.n_in_row = max64((snapped->n_triangles + n_pieces) << sample_bits, 1);
    const int64_t hot = TL_SHAPE_SPANS / 4 / f.n_in_row;
    f.n_rows = hot >= 64 ? hot : min64(64, TL_SHAPE_SPANS / f.n_in_row);
    fill_shape_rows(&f, window, samples_fx);
    return -1;
}

#endif
