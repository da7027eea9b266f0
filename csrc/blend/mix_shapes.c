/* Mix of a few large flat triangles over one colour: rows as runs of pixels that are not written yet.
 * In: pixels that the current triangle covers whole or in part.  Out: runs, and partly covered pixels.
 *
 * A triangle that covers a run wholly sets its bit in the run's key; the colour of a key is blended once and cached.
 * Partly covered pixels are blended in the picture, where its pixels are four bytes, or else in a side buffer of a band
 * of rows: one triangle after the other, as in a picture without runs. */
#ifndef TL_MIX_SHAPES_C
#define TL_MIX_SHAPES_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "large_shapes/row_runs.c"
#include "blend/mix.c"
#include "blend/mix.h"
#include "blend/mix_u8.c"

#define TL_KEY_BUFFERED (1ull << 63) /* the pixels of the run are in the side buffer */
#define TL_MIXED_KEYS_BITS 4

/* The colour of a key: as bytes of the picture, and as a pixel of the canvas. */
typedef struct {
    uint64_t key;
    char value[16];
    union {
        int32_t packed;
        float floats[4];
    } canvas;
} mixed_color;

typedef struct shape_state {
    const tl_canvas *canvas; /* the picture; the blend_state draws into the side buffer */
    int pixel_bytes, is_in_place;
    int64_t id; /* of the current triangle */
    mixed_color colors[1 << TL_MIXED_KEYS_BITS];
    row_runs rows[TL_BLENDED_ROWS];
    blend_state one; /* for a picture of one pixel */
} shape_state;

/* ---- colours ----------------------------------------------------------------------------------------------------- */

/* Blends the triangles of a key over the ground, for one pixel. */
static __attribute__((noinline)) void mix_key(shape_state *f, uint64_t key, mixed_color *c)
{
    blend_state *one = &f->one;
    const int n_channels = f->canvas->n_channels, is_u8 = f->canvas->is_u8;
    int32_t packed[TL_MAX_LANES + 1] = {one->ground};
    float floats[4 * (TL_MAX_LANES + 1)] = {0};
    if (!is_u8)
        memcpy(floats, f->canvas->ground, sizeof *floats * (size_t)n_channels);
    one->packed = packed, one->floats = floats;
    for (uint64_t bits = key; bits; bits &= bits - 1)
        if (begin_flat(one, __builtin_ctzll(bits)))
            mix_pixels(one, 0, 1);
    c->key = key;
    if (is_u8) {
        uint8_t bytes[4];
        c->canvas.packed = packed[0];
        if (n_channels == 4)
            memcpy(bytes, packed, 4);
        else
            unpack_u8(packed, 1, n_channels, bytes);
        memcpy(c->value, bytes, (size_t)n_channels);
    } else {
        memcpy(c->canvas.floats, floats, sizeof *floats * (size_t)n_channels);
        memcpy(c->value, floats, sizeof *floats * (size_t)n_channels);
    }
}

TL_INLINE const mixed_color *color_of_mix(shape_state *f, uint64_t key)
{
    mixed_color *c = f->colors + (key * 0x9e3779b97f4a7c15u >> (64 - TL_MIXED_KEYS_BITS));
    if (c->key != key)
        mix_key(f, key, c);
    return c;
}

/* ---- runs -------------------------------------------------------------------------------------------------------- */

/* The run that begins at `col`; cuts a run there if needed.  r->n at the end of the row. */
TL_INLINE int run_from(row_runs *r, int32_t col)
{
    int k = 0;
    while (k < r->n && r->col[k + 1] <= col)
        k++;
    if (k < r->n && r->col[k] < col)
        cut_run(r, k++, col);
    return k;
}

/* Joins runs [k, end), whose pixels are in the side buffer, with neighbouring runs in it. */
TL_INLINE void join_runs(row_runs *r, int k, int end)
{
    if (k > 0 && r->key[k - 1] == TL_KEY_BUFFERED)
        k--;
    if (end < r->n && r->key[end] == TL_KEY_BUFFERED)
        end++;
    const int n_gone = end - k - 1;
    r->key[k] = TL_KEY_BUFFERED;
    for (int i = k + 1; n_gone > 0 && i + n_gone <= r->n; i++)
        r->col[i] = r->col[i + n_gone], r->key[i] = r->key[i + n_gone];
    r->n -= n_gone;
}

/* Blends the pixels [first, end) of a row into the side buffer. */
static __attribute__((noinline)) void buffer_pixels(blend_state *b, int64_t row, int32_t first, int32_t end)
{
    shape_state *f = b->shapes;
    row_runs *r = f->rows + row;
    if (r->n >= TL_BLENDED_RUNS) /* more cuts than convex shapes make: buffers all of the row */
        first = 0, end = r->col[r->n];
    const int from = run_from(r, first), to = run_from(r, end);
    const int64_t at = row * b->stride, n_channels = b->n_channels;
    for (int k = from; k < to; k++) {
        if (r->key[k] == TL_KEY_BUFFERED)
            continue;
        const mixed_color *c = color_of_mix(f, r->key[k]);
        if (f->canvas->is_u8)
            for (int32_t i = r->col[k]; i < r->col[k + 1]; i++)
                b->packed[at + i] = c->canvas.packed;
        else
            for (int32_t i = r->col[k]; i < r->col[k + 1]; i++)
                memcpy(b->floats + (at + i) * n_channels, c->canvas.floats, sizeof(float) * (size_t)n_channels);
    }
    join_runs(r, from, to);
}

static void read_buffered(blend_state *b, int64_t at, int64_t n)
{
    const int64_t row = (int64_t)((uint32_t)at / (uint32_t)b->stride);
    const int32_t first = (int32_t)(at - row * b->stride), end = (int32_t)(first + n);
    const row_runs *r = b->shapes->rows + row;
    for (int k = 0; k < r->n && r->col[k] <= first; k++)
        if (r->key[k] == TL_KEY_BUFFERED && end <= r->col[k + 1])
            return;
    buffer_pixels(b, row, first, end);
}

static void lay_whole(blend_state *b, int64_t at, int64_t n)
{
    shape_state *f = b->shapes;
    const int64_t row = (int64_t)((uint32_t)at / (uint32_t)b->stride), start = row * b->stride;
    const uint64_t bit = 1ull << f->id;
    row_runs *r = f->rows + row;
    if (r->n >= TL_BLENDED_RUNS)
        buffer_pixels(b, row, 0, r->col[r->n]);
    const int from = run_from(r, (int32_t)(at - start)), to = run_from(r, (int32_t)(at - start + n));
    for (int k = from; k < to; k++) {
        if (b->whole_mode == TL_MIX_REPLACE)
            r->key[k] = bit;
        else if (r->key[k] == TL_KEY_BUFFERED)
            mix_pixels(b, start + r->col[k], r->col[k + 1] - r->col[k]);
        else
            r->key[k] |= bit;
    }
}

static void mix_run(struct blend_state *b, int64_t at, int64_t n)
{
    if (b->shapes)
        lay_whole(b, at, n);
    else
        mix_pixels(b, at, n);
}

#endif
