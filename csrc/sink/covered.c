/* Coverage while drawing, a bit a sample, and its picture at the end.
 * In: covered samples.  Out: a byte of 0 or 1 each; or, for 2 to 16 samples a pixel, the covered share, float32.
 *
 * An eighth of the memory stays in a nearer cache while triangles overdraw each other, and the bytes are written once
 * instead of being cleared first.  Bits are in the order of the pixels, row * stride_px + column; those of a pixel are
 * side by side, in the order of its samples: bit (pixel << sample_bits) + sample. */
#ifndef TL_COVERED_C
#define TL_COVERED_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"

_Static_assert(4 * 64 / TL_MAX_SAMPLES >= TL_LANES, "the pixels of four words are whole vectors");
#define TL_EVEN_WORDS 8 /* the least number that is worth a call */

/* Sets the bits of samples from `at` on. */
TL_INLINE void cover(const tl_target *target, int64_t at, uint64_t bits)
{
    uint64_t *words = target->covered + (at >> 6);
    const int shift = at & 63;
    words[0] |= bits << shift;
    words[1] |= bits >> 1 >> (63 - shift);
}

/* The bits of samples [at, at + n) in the word that begins at sample `word`. */
TL_INLINE uint64_t word_bits(int64_t at, int64_t n, int64_t word)
{
    const int64_t first = at - word, rest = word + 64 - (at + n);
    return ~0ull << (first > 0 ? first : 0) & ~0ull >> (rest > 0 ? rest : 0);
}

/* Sets the bits [at, at + n), n > 0. */
TL_INLINE void cover_span(const tl_target *target, int64_t at, int64_t n)
{
    uint64_t *const words = target->covered;
    const int64_t first = at >> 6, last = (at + n - 1) >> 6;
    words[first] |= word_bits(at, n, first << 6);
    for (int64_t k = first + 1; k < last; k++)
        words[k] = ~0ull;
    if (last > first)
        words[last] |= word_bits(at, n, last << 6);
}

/* How many of n words equal the first word; 0 when that has both 0 and 1 bits. */
TL_INLINE int64_t even_words(const uint64_t *words, int64_t n)
{
    const uint64_t value = words[0];
    int64_t k = 0;
    if (value + 1 > 1)
        return 0;
    while (k + 4 <= n &&
           !((words[k] ^ value) | (words[k + 1] ^ value) | (words[k + 2] ^ value) | (words[k + 3] ^ value)))
        k += 4;
    while (k < n && words[k] == value)
        k++;
    return k;
}

/* Writes the bytes of the samples [at, at + n).  `memset` writes long runs of one value: an empty frame of 8 MB takes
 * 0.15 ms instead of 0.19. */
static void expand_span(const tl_target *target, int64_t at, int64_t n)
{
    uint8_t *const pixels = target->pixels;
    const uint64_t *const covered = target->covered;
    const int64_t end = at + n;
    for (; at < end && (at & 63); at++)
        pixels[at] = covered[at >> 6] >> (at & 63) & 1;
    while (at + 64 <= end) {
        const uint64_t bits = covered[at >> 6];
        const int64_t n_even = even_words(covered + (at >> 6), (end - at) >> 6);
        if (n_even >= TL_EVEN_WORDS) {
            memset(pixels + at, (int)(bits & 1), (size_t)(64 * n_even));
            at += 64 * n_even;
            continue;
        }
        bytes_from_bits(pixels + at, bits);
        at += 64;
    }
    for (; at < end; at++)
        pixels[at] = covered[at >> 6] >> (at & 63) & 1;
}

static void expand_covered(const tl_window *window, const tl_target *target)
{
    if (target->stride_px == window->width) {
        expand_span(target, 0, window->width * window->height);
        return;
    }
    for (int64_t row = 0; row < window->height; row++)
        expand_span(target, row * target->stride_px, window->width);
}

/* Bits 0, 2^sample_bits, 2 * 2^sample_bits, ... */
TL_INLINE uint64_t sample_pattern(int sample_bits)
{
    static const uint64_t patterns[5] = {~0ull, 0x5555555555555555u, 0x1111111111111111u, 0x0101010101010101u,
                                         0x0001000100010001u};
    return patterns[sample_bits];
}

/* Sets the bits of the current sample of the pixels [at, at + n), n > 0. */
TL_INLINE void cover_samples(const tl_target *target, int64_t at, int64_t n)
{
    uint64_t *const words = target->covered;
    const uint64_t pattern = sample_pattern(target->sample_bits) << target->sample;
    const int64_t begin = at << target->sample_bits, length = n << target->sample_bits;
    const int64_t first = begin >> 6, last = (begin + length - 1) >> 6;
    words[first] |= pattern & word_bits(begin, length, first << 6);
    for (int64_t k = first + 1; k < last; k++)
        words[k] |= pattern;
    if (last > first)
        words[last] |= pattern & word_bits(begin, length, last << 6);
}

/* The number of set bits in each group of 2^sample_bits bits, in place of the group. */
TL_INLINE uint64_t count_bits(uint64_t v, int sample_bits)
{
    v -= v >> 1 & 0x5555555555555555u;
    if (sample_bits > 1)
        v = (v & 0x3333333333333333u) + (v >> 2 & 0x3333333333333333u);
    if (sample_bits > 2)
        v = (v + (v >> 4)) & 0x0f0f0f0f0f0f0f0fu;
    if (sample_bits > 3)
        v = (v + (v >> 8)) & 0x00ff00ff00ff00ffu;
    return v;
}

/* Writes the shares of the pixels [at, at + n), at a multiple of 32.  Long runs that are wholly covered, or not
 * covered, are filled: eight words of four samples are 128 pixels. */
TL_INLINE void share_span(const tl_target *target, int64_t at, int64_t n, int sample_bits)
{
    const int per_word = 64 >> sample_bits, width = 1 << sample_bits;
    const float share = 1.0f / (float)width;
    const uint64_t *word = target->covered + (at >> (6 - sample_bits));
    float *pixels = (float *)target->pixels + at;
    while (n >= per_word) {
        const int64_t n_even = even_words(word, n >> (6 - sample_bits)) & ~(int64_t)3; /* whole vectors of pixels */
        const int64_t n_px = n_even << (6 - sample_bits);
        if (n_even >= TL_EVEN_WORDS) {
            const vf even = vf_set1(*word ? 1.0f : 0.0f);
            for (int64_t k = 0; k < n_px; k += TL_LANES)
                vf_store(pixels + k, even);
            word += n_even, pixels += n_px, n -= n_px;
            continue;
        }
        const uint64_t counts = count_bits(*word++, sample_bits);
        for (int k = 0; k < per_word; k++)
            pixels[k] = (float)(int32_t)(counts >> (k * width) & (2 * (unsigned)width - 1)) * share;
        pixels += per_word, n -= per_word;
    }
    const uint64_t counts = n ? count_bits(*word, sample_bits) : 0;
    for (int k = 0; k < n; k++)
        pixels[k] = (float)(int32_t)(counts >> (k * width) & (2 * (unsigned)width - 1)) * share;
}

/* Writes the share of covered samples of every pixel; the window has no gaps between rows. */
static void share_samples(const tl_window *window, const tl_target *target)
{
    const int64_t n = window->width * window->height;
    switch (target->sample_bits) {
    case 1: share_span(target, 0, n, 1); break;
    case 2: share_span(target, 0, n, 2); break;
    case 3: share_span(target, 0, n, 3); break;
    default: share_span(target, 0, n, 4); break;
    }
}

#endif
