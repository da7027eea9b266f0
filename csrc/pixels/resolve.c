/* Resolves MSAA: averages the colours of the samples of a pixel, all with equal weight (a box filter one pixel wide).
 * Also sets the depth of a picture with one depth for all triangles, after its ids were drawn without depth.
 * In: the label of each sample, or colours of samples; ids.  Out: colours; a sample with label -1 counts as the old
 * pixel; ids and depth.
 *
 * uint8: the mean rounded to nearest, ties to even.  float32: summed in float64 in the order of the samples, rounded
 * once.  Straight alpha that differs between the samples: colours are weighted by it.
 *
 * Based on: T. Porter, T. Duff, Compositing Digital Images, 1984 (sums are of premultiplied colours). */
#ifndef TL_RESOLVE_C
#define TL_RESOLVE_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "sink/covered.c"

TL_INLINE uint8_t mean_u8(const uint8_t *values, int sample_bits, const tl_transfer *transfer)
{
    int32_t sum = 0;
    for (int k = 0; k < 1 << sample_bits; k++)
        sum += transfer ? transfer->decode[values[k]] : values[k];
    const int32_t half = 1 << sample_bits >> 1, is_odd = sum >> sample_bits & 1;
    const int32_t mean = (sum + half - 1 + is_odd) >> sample_bits;
    return transfer ? transfer->encode[mean] : (uint8_t)mean;
}

/* The mean of samples, weighted by their alpha. */
TL_INLINE uint8_t weighted_mean_u8(const uint8_t *values, const uint8_t *alpha, int sample_bits,
                                   const tl_transfer *transfer)
{
    int32_t sum = 0, total = 0; /* at most 16 * 255 * 65536 < 2^29 */
    for (int k = 0; k < 1 << sample_bits; k++) {
        sum += alpha[k] * (transfer ? transfer->decode[values[k]] : values[k]);
        total += alpha[k];
    }
    int32_t mean = sum / total;
    const int32_t twice_rest = 2 * (sum - mean * total);
    mean += twice_rest > total || (twice_rest == total && mean & 1);
    return transfer ? transfer->encode[mean] : (uint8_t)mean;
}

TL_INLINE float mean_f32(const float *values, int sample_bits)
{
    double sum = 0.0;
    for (int k = 0; k < 1 << sample_bits; k++)
        sum += (double)values[k];
    return (float)(sum / (double)(1 << sample_bits));
}

TL_INLINE float weighted_mean_f32(const float *values, const float *alpha, int sample_bits, double total)
{
    double sum = 0.0;
    for (int k = 0; k < 1 << sample_bits; k++)
        sum += (double)alpha[k] * (double)values[k];
    return (float)(sum / total);
}

/* Averages one pixel; colors[k] points to the colour of sample k. */
TL_INLINE void mean_pixel_u8(const void *const *colors, int sample_bits, int n_channels, const tl_transfer *transfer,
                             uint8_t *pixel)
{
    const tl_transfer *light = transfer && transfer->decode ? transfer : NULL;
    const int n_colors = transfer ? transfer->n_channels : 0;
    uint8_t values[TL_MAX_SAMPLES], alpha[TL_MAX_SAMPLES];
    int differs = 0; /* if so, the sum of alpha is not 0 */
    if (transfer && transfer->is_straight)
        for (int k = 0; k < 1 << sample_bits; k++) {
            alpha[k] = ((const uint8_t *)colors[k])[n_colors];
            differs |= alpha[k] ^ alpha[0];
        }
    for (int c = 0; c < n_channels; c++) {
        for (int k = 0; k < 1 << sample_bits; k++)
            values[k] = ((const uint8_t *)colors[k])[c];
        pixel[c] = differs && c < n_colors ? weighted_mean_u8(values, alpha, sample_bits, light)
                                           : mean_u8(values, sample_bits, c < n_colors ? light : NULL);
    }
}

TL_INLINE void mean_pixel_f32(const void *const *colors, int sample_bits, int n_channels, const tl_transfer *transfer,
                              float *pixel)
{
    const int n_colors = transfer ? transfer->n_channels : 0;
    float values[TL_MAX_SAMPLES], alpha[TL_MAX_SAMPLES];
    double total = 0.0;
    int differs = 0;
    if (transfer && transfer->is_straight)
        for (int k = 0; k < 1 << sample_bits; k++) {
            alpha[k] = ((const float *)colors[k])[n_colors];
            differs |= alpha[k] != alpha[0];
            total += (double)alpha[k];
        }
    for (int c = 0; c < n_channels; c++) {
        for (int k = 0; k < 1 << sample_bits; k++)
            values[k] = ((const float *)colors[k])[c];
        pixel[c] = differs && total != 0.0 && c < n_colors ? weighted_mean_f32(values, alpha, sample_bits, total)
                                                           : mean_f32(values, sample_bits);
    }
}

TL_INLINE void mean_pixel(const void *const *colors, int sample_bits, int n_channels, int is_u8,
                          const tl_transfer *transfer, void *pixel)
{
    if (is_u8)
        mean_pixel_u8(colors, sample_bits, n_channels, transfer, pixel);
    else
        mean_pixel_f32(colors, sample_bits, n_channels, transfer, pixel);
}

/* Turns two sums of up to 2^4 bytes, 16 bits apart, into their means. */
TL_INLINE vi mean_pairs(vi sums, int sample_bits)
{
    const vi is_odd = vi_and(vi_shift_right(sums, sample_bits), vi_set1(0x00010001));
    const vi half = vi_set1(0x00010001 * ((1 << sample_bits >> 1) - 1));
    return vi_and(vi_shift_right(vi_add(vi_add(sums, half), is_odd), sample_bits), vi_set1(0x00ff00ff));
}

/* Colours of triangles, and how the samples of a pixel are averaged. */
typedef struct {
    const char *colors;
    int row_bytes, n_channels, is_u8, sample_bits;
    int64_t stride; /* from sample to sample of a pixel */
    const tl_transfer *transfer;
} mean_source;

TL_ONCE void mean_labels(const mean_source *s, const int32_t *labels, char *pixel)
{
    const void *own[TL_MAX_SAMPLES];
    for (int k = 0; k < 1 << s->sample_bits; k++) {
        const int64_t label = labels[k * s->stride];
        own[k] = label < 0 ? (const void *)pixel : s->colors + label * s->row_bytes;
    }
    mean_pixel(own, s->sample_bits, s->n_channels, s->is_u8, s->transfer, pixel);
}

/* The means of the bytes of TL_LANES pixels of four bytes; `own` are the old pixels.  Lanes in `rest` need weights by
 * alpha and are not set. */
TL_INLINE vi mean_bytes(const mean_source *s, const int32_t *labels, vm live, vi own, vm *rest)
{
    const tl_transfer *transfer = s->transfer;
    const vi alpha = vi_set1(transfer && transfer->is_straight ? (int32_t)(0xffu << 8 * transfer->n_channels) : 0);
    const vi minus_one = vi_set1(-1), bytes = vi_set1(0x00ff00ff), first = vi_load_masked(live, labels);
    const int32_t *palette = (const int32_t *)(const void *)s->colors;
    vm is_mixed = vm_and_not(live, vm_all());
    *rest = is_mixed;
    for (int k = 1; k < 1 << s->sample_bits; k++)
        is_mixed = vm_or(is_mixed, vm_and_not(live, vi_eq(vi_load_masked(live, labels + k * s->stride), first)));
    if (!vm_any(vm_or(is_mixed, vm_and_not(vm_all(), vi_eq(first, vi_set1(labels[0])))))) /* within one triangle */
        return labels[0] < 0 ? own : vi_set1(palette[labels[0]]);
    const vm is_drawn = vm_and(live, vi_gt(first, minus_one));
    const vi color = vi_select(is_drawn, vi_gather(is_drawn, palette, first), own);
    vi even = vi_and(color, bytes), odd = vi_and(vi_shift_right(color, 8), bytes);
    if (!vm_any(is_mixed))
        return color;
    for (int k = 1; k < 1 << s->sample_bits; k++) {
        const vi label = vi_load_masked(is_mixed, labels + k * s->stride);
        const vm m = vm_and(is_mixed, vi_gt(label, minus_one));
        const vi other = vi_select(m, vi_gather(m, palette, label), own);
        even = vi_add(even, vi_and(other, bytes));
        odd = vi_add(odd, vi_and(vi_shift_right(other, 8), bytes));
        *rest = vm_or(*rest, vm_and_not(is_mixed, vi_eq(vi_and(other, alpha), vi_and(color, alpha))));
    }
    return vi_select(is_mixed,
                     vi_or(mean_pairs(even, s->sample_bits), vi_shift_left(mean_pairs(odd, s->sample_bits), 8)), color);
}

/* Pixels tested together: within a large triangle, and in the background, all their samples have one label. */
#define MEAN_BLOCK 64

TL_INLINE int block_has_one_label(const mean_source *s, const int32_t *labels)
{
    const int32_t *last = labels + (((int64_t)1 << s->sample_bits) - 1) * s->stride;
    if (labels[0] != labels[MEAN_BLOCK - 1] || labels[0] != last[0] || labels[0] != last[MEAN_BLOCK - 1])
        return 0; /* a cheap test that most edges fail */
    const vi first = vi_set1(labels[0]);
    vi differs = vi_set1(0);
    for (; labels <= last; labels += s->stride)
        for (int i = 0; i < MEAN_BLOCK; i += TL_LANES)
            differs = vi_or(differs, vi_xor(vi_load(labels + i), first));
    return !vm_any(vm_and_not(vm_all(), vi_eq(differs, vi_set1(0))));
}

/* Paints MEAN_BLOCK pixels of one triangle; a label < 0 changes nothing. */
TL_INLINE void paint_block(const mean_source *s, int32_t label, int pixel_bytes, char *pixels)
{
    if (label < 0)
        return;
    const char *color = s->colors + (int64_t)label * s->row_bytes;
    if (pixel_bytes == 4) {
        int32_t whole;
        memcpy(&whole, color, 4);
        for (int i = 0; i < MEAN_BLOCK; i += TL_LANES)
            vi_store((int32_t *)(void *)pixels + i, vi_set1(whole));
        return;
    }
    memcpy(pixels, color, (size_t)pixel_bytes);
    for (size_t done = (size_t)pixel_bytes; done < (size_t)pixel_bytes * MEAN_BLOCK; done *= 2)
        memcpy(pixels + done, pixels, done);
}

/* Averages n pixels of n_channels bytes. */
TL_INLINE void mean_flat_bytes(const mean_source *s, const int32_t *labels, int64_t n, int n_channels, char *pixels)
{
    for (int64_t i = 0; i < n; i += TL_LANES) {
        while (i % MEAN_BLOCK == 0 && i + MEAN_BLOCK < n && block_has_one_label(s, labels + i)) {
            paint_block(s, labels[i], n_channels, pixels + n_channels * i);
            i += MEAN_BLOCK;
        }
        const vm live = vm_first(n - i);
        const int end = n - i < TL_LANES ? (int)(n - i) : TL_LANES;
        char *const own = pixels + n_channels * i;
        vm rest;
        if (n_channels == 4) {
            int32_t *const whole = (int32_t *)(void *)own;
            const vi mean = mean_bytes(s, labels + i, live, vi_load_masked(live, whole), &rest);
            vi_store_masked(whole, vm_and_not(live, rest), mean);
        } else {
            int32_t colors[TL_MAX_LANES] = {0};
            for (int k = 0; k < end; k++)
                memcpy(colors + k, own + n_channels * k, (size_t)n_channels);
            vi_store(colors, mean_bytes(s, labels + i, live, vi_load(colors), &rest));
            for (int k = 0; k < end; k++)
                if (!(vm_bits(rest) >> k & 1))
                    memcpy(own + n_channels * k, colors + k, (size_t)n_channels);
        }
        for (unsigned lanes = vm_bits(rest); lanes; lanes &= lanes - 1)
            mean_labels(s, labels + i + __builtin_ctz(lanes), own + n_channels * __builtin_ctz(lanes));
    }
}

/* Averages n pixels one by one. */
TL_INLINE void mean_flat_pixels(const mean_source *s, const int32_t *labels, int64_t n, char *pixel)
{
    const int pixel_bytes = s->n_channels * (s->is_u8 ? 1 : 4);
    for (int64_t i = 0; i < n; i++, labels++, pixel += pixel_bytes) {
        while (i % MEAN_BLOCK == 0 && i + MEAN_BLOCK < n && block_has_one_label(s, labels)) {
            paint_block(s, labels[0], pixel_bytes, pixel);
            i += MEAN_BLOCK, labels += MEAN_BLOCK, pixel += (int64_t)MEAN_BLOCK * pixel_bytes;
        }
        const int32_t first = labels[0];
        int32_t differs = 0;
        for (int k = 1; k < 1 << s->sample_bits; k++)
            differs |= labels[k * s->stride] ^ first;
        if (differs)
            mean_labels(s, labels, pixel);
        else if (first >= 0)
            memcpy(pixel, s->colors + (int64_t)first * s->row_bytes, (size_t)pixel_bytes);
    }
}

static void mean_flat(const int32_t *labels, int sample_bits, int64_t stride, int64_t n, const void *palette,
                      int n_channels, int is_u8, const tl_transfer *transfer, void *pixels)
{
    const mean_source s = {palette, is_u8 ? 4 : 4 * n_channels, n_channels, is_u8, sample_bits, stride, transfer};
    if (!is_u8 || (transfer && transfer->decode))
        mean_flat_pixels(&s, labels, n, pixels);
    else if (n_channels == 4)
        mean_flat_bytes(&s, labels, n, 4, pixels);
    else if (n_channels == 3)
        mean_flat_bytes(&s, labels, n, 3, pixels);
    else
        mean_flat_bytes(&s, labels, n, n_channels, pixels);
}

static void mean_colors(const void *colors, int sample_bits, int64_t stride, int64_t n, int n_channels, int is_u8,
                        const tl_transfer *transfer, void *pixels)
{
    const int pixel_bytes = n_channels * (is_u8 ? 1 : 4);
    for (int64_t i = 0; i < n; i++) {
        const void *own[TL_MAX_SAMPLES];
        for (int k = 0; k < 1 << sample_bits; k++)
            own[k] = (const char *)colors + (k * stride + i) * pixel_bytes;
        mean_pixel(own, sample_bits, n_channels, is_u8, transfer, (char *)pixels + i * pixel_bytes);
    }
}

static void set_flat_depth(int32_t *restrict ids, int64_t n, int32_t flip, float depth, float background,
                           float *restrict out)
{
    for (int64_t k = 0; k < n; k++) {
        const int32_t id = ids[k];
        out[k] = id < 0 ? background : depth;
        ids[k] = id < 0 ? id : id ^ flip;
    }
}

#endif
