/* Runs of pixels that hold one value, each written once; a run may go on in the next row.
 * In: runs, from the first pixel of some rows on.  Out: pixels. */
#ifndef TL_PIXEL_RUNS_C
#define TL_PIXEL_RUNS_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"

/* n > 0 pixels of one value.  Vectors begin at multiples of their size, for a store across two cache lines takes twice
 * as long; `may_overrun`: it may write up to one vector past n; the caller overwrites that. */
TL_INLINE void put_words(int32_t *pixels, int64_t n, int32_t value, int may_overrun)
{
    const vi values = vi_set1(value);
    int32_t *const end = pixels + n;
    int32_t *p = pixels + TL_LANES - ((uintptr_t)pixels >> 2) % TL_LANES;
    if (!may_overrun && n < TL_LANES) {
        for (int64_t k = 0; k < n; k++)
            pixels[k] = value;
        return;
    }
    vi_store(pixels, values);
    for (; end - p >= 4 * TL_LANES; p += 4 * TL_LANES)
        for (int k = 0; k < 4; k++)
            vi_store(p + k * TL_LANES, values);
    for (; end - p >= (may_overrun ? 1 : TL_LANES); p += TL_LANES)
        vi_store(p, values);
    if (!may_overrun)
        vi_store(end - TL_LANES, values);
}

/* n > 0 pixels of one value and of any size. */
static void put_pixels(char *pixels, int64_t n, const char *value, size_t pixel_bytes)
{
    const size_t all = (size_t)n * pixel_bytes, most = 1024 / pixel_bytes * pixel_bytes;
    memcpy(pixels, value, pixel_bytes);
    for (size_t done = pixel_bytes; done < all;) { /* twice as many each time, up to 1 kB */
        const size_t part = done < most ? done : most, size = all - done < part ? all - done : part;
        memcpy(pixels + done, pixels, size);
        done += size;
    }
}

/* Many pixels of one value and of any size, by vectors that begin at multiples of their size: as many as hold whole
 * pixels, three of pixels of 3 or 12 bytes. */
TL_INLINE void put_patterns(char *pixels, int64_t n, const char *value, int64_t pixel_bytes, int n_vectors)
{
    const int64_t size = 4 * TL_LANES, period = n_vectors * size;
    const int64_t all = n * pixel_bytes, to_aligned = size - (int64_t)((uintptr_t)pixels % (uintptr_t)size);
    char pattern[5 * 4 * TL_MAX_LANES];
    if (period % pixel_bytes || all < 2 * period) {
        put_pixels(pixels, n, value, (size_t)pixel_bytes);
        return;
    }
    put_pixels(pattern, (period + size) / pixel_bytes + 1, value, (size_t)pixel_bytes);
    const int32_t *aligned = (const int32_t *)(const void *)(pattern + to_aligned);
    const vi a = vi_load(aligned), b = vi_load(aligned + (n_vectors == 3 ? TL_LANES : 0));
    const vi c = vi_load(aligned + (n_vectors == 3 ? 2 * TL_LANES : 0));
    memcpy(pixels, pattern, (size_t)size);
    for (char *p = pixels + to_aligned; p + period <= pixels + all; p += period) {
        int32_t *const words = (int32_t *)(void *)p;
        vi_store(words, a);
        if (n_vectors == 3) {
            vi_store(words + TL_LANES, b);
            vi_store(words + 2 * TL_LANES, c);
        }
    }
    memcpy(pixels + all - period, pattern, (size_t)period); /* some of it again */
}

/* n > 0 pixels of one value; `may_overrun` as for put_words. */
TL_INLINE void put_run(char *pixels, int64_t n, const char *value, int pixel_bytes, int may_overrun)
{
    int32_t word;
    if (pixel_bytes == 1) {
        memset(pixels, value[0], (size_t)n);
    } else if (pixel_bytes == 4) {
        memcpy(&word, value, 4);
        put_words((int32_t *)(void *)pixels, n, word, may_overrun);
    } else {
        put_patterns(pixels, n, value, pixel_bytes, pixel_bytes % 3 ? 1 : 3);
    }
}

/* A run that is known as far as `end`, and may go on, in the next row, too, if rows follow one another.
 * Pixels are counted from the first one of the rows that this pass writes. */
typedef struct {
    char *pixels;
    int64_t first, end;
    int64_t n_px; /* of all rows of the pass, whatever lies behind; 0 where rows do not follow one another */
    char value[16];
} open_run;

/* For n_rows of `width` pixels, `stride` apart. */
TL_INLINE open_run start_pixels(void *pixels, int64_t width, int64_t n_rows, int64_t stride)
{
    return (open_run){.pixels = pixels, .n_px = width == stride ? width * n_rows : 0};
}

/* Writes the known pixels, and may write a few more, which are written again later. */
TL_INLINE void close_run(const open_run *run, int pixel_bytes)
{
    const int may_overrun = run->n_px - run->end >= 4 * TL_LANES;
    if (run->first < run->end)
        put_run(run->pixels + run->first * pixel_bytes, run->end - run->first, run->value, pixel_bytes, may_overrun);
}

/* The pixels [first, end) hold `value`. */
TL_INLINE void add_pixels(open_run *run, int64_t first, int64_t end, const char *value, int pixel_bytes)
{
    if (first != run->end || memcmp(run->value, value, (size_t)pixel_bytes) != 0) {
        close_run(run, pixel_bytes);
        run->first = first;
        memcpy(run->value, value, (size_t)pixel_bytes);
    }
    run->end = end;
}

#endif
