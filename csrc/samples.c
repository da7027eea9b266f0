/* Samples: which of the 2 to 16 samples of each pixel are covered, as bits while they are drawn, and their share at the end.
 * In: samples as they are drawn.  Out: a float32 a pixel.
 *
 * The bits of a pixel lie side by side, in the order of its samples: bit (pixel << sample_bits) + sample, pixels as in covered.c.
 * One pass over the words counts them. */
#include "fixed.h"
#include "lanes.h"

/* Every 2^sample_bits-th bit, from the first. */
TL_INLINE uint64_t sample_pattern(int sample_bits)
{
    static const uint64_t patterns[5] = {~0ull, 0x5555555555555555u, 0x1111111111111111u, 0x0101010101010101u, 0x0001000100010001u};
    return patterns[sample_bits];
}

/* Marks the sample of the pixels [at, at + n), n > 0. */
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

/* Sums of 2^sample_bits bits each, where those lay. */
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

/* The pixels [at, at + n), at a multiple of 32. */
TL_INLINE void share_span(const tl_target *target, int64_t at, int64_t n, int sample_bits)
{
    const int per_word = 64 >> sample_bits, width = 1 << sample_bits;
    const float share = 1.0f / (float)width;
    const uint64_t *word = target->covered + (at >> (6 - sample_bits));
    float *pixels = (float *)target->pixels + at;
    for (; n >= per_word; n -= per_word, pixels += per_word) {
        const uint64_t counts = count_bits(*word++, sample_bits);
        for (int k = 0; k < per_word; k++)
            pixels[k] = (float)(int32_t)(counts >> (k * width) & (2 * (unsigned)width - 1)) * share;
    }
    const uint64_t counts = n ? count_bits(*word, sample_bits) : 0;
    for (int k = 0; k < n; k++)
        pixels[k] = (float)(int32_t)(counts >> (k * width) & (2 * (unsigned)width - 1)) * share;
}

/* Writes the share of covered samples of every pixel; rows of the window follow one another. */
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
