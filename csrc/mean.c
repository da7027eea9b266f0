/* Mean: the colour of a pixel from those of its samples, all with the same weight (a box filter one pixel wide).
 * In: the label of each sample, or colours of samples.  Out: colours; a sample with label -1 counts as what the pixel holds.
 *
 * uint8: the mean rounded to nearest, ties to even.  float32: summed in float64 in the order of the samples, rounded once.
 * Straight alpha that differs between the samples: colours are weighted by it.
 *
 * Based on: T. Porter, T. Duff, Compositing Digital Images, 1984 (sums are of premultiplied colours). */
#include "fixed.h"

TL_INLINE uint8_t mean_u8(const uint8_t *values, int sample_bits, const tl_transfer *transfer)
{
    int32_t sum = 0;
    for (int k = 0; k < 1 << sample_bits; k++)
        sum += transfer ? transfer->decode[values[k]] : values[k];
    const int32_t half = 1 << sample_bits >> 1, is_odd = sum >> sample_bits & 1;
    const int32_t mean = (sum + half - 1 + is_odd) >> sample_bits;
    return transfer ? transfer->encode[mean] : (uint8_t)mean;
}

/* The same, each sample as often as its alpha says. */
TL_INLINE uint8_t weighted_mean_u8(const uint8_t *values, const uint8_t *alpha, int sample_bits, const tl_transfer *transfer)
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

/* One pixel: the colour of sample k stands at colors[k]. */
TL_INLINE void mean_pixel_u8(const void *const *colors, int sample_bits, int n_channels, const tl_transfer *transfer, uint8_t *pixel)
{
    const tl_transfer *light = transfer && transfer->decode ? transfer : NULL;
    const int n_colors = transfer ? transfer->n_channels : 0;
    uint8_t values[TL_MAX_SAMPLES], alpha[TL_MAX_SAMPLES];
    int differs = 0; /* alpha that differs is not 0 everywhere */
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

TL_INLINE void mean_pixel_f32(const void *const *colors, int sample_bits, int n_channels, const tl_transfer *transfer, float *pixel)
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

TL_INLINE void mean_pixel(const void *const *colors, int sample_bits, int n_channels, int is_u8, const tl_transfer *transfer, void *pixel)
{
    if (is_u8)
        mean_pixel_u8(colors, sample_bits, n_channels, transfer, pixel);
    else
        mean_pixel_f32(colors, sample_bits, n_channels, transfer, pixel);
}

/* n pixels whose samples have the colours of their triangles; planes of labels lie `stride` apart. */
static void mean_flat(const int32_t *labels, int sample_bits, int64_t stride, int64_t n, const void *colors, int n_channels, int is_u8,
                      const tl_transfer *transfer, void *pixels)
{
    const int pixel_bytes = n_channels * (is_u8 ? 1 : 4);
    char *pixel = pixels;
    for (int64_t i = 0; i < n; i++, labels++, pixel += pixel_bytes) {
        const int32_t first = labels[0];
        int32_t differs = 0;
        for (int k = 1; k < 1 << sample_bits; k++)
            differs |= labels[k * stride] ^ first;
        if (!differs) {
            if (first >= 0)
                memcpy(pixel, (const char *)colors + (int64_t)first * pixel_bytes, (size_t)pixel_bytes);
            continue;
        }
        const void *own[TL_MAX_SAMPLES];
        for (int k = 0; k < 1 << sample_bits; k++) {
            const int64_t label = labels[k * stride];
            own[k] = label < 0 ? (const void *)pixel : (const char *)colors + label * pixel_bytes;
        }
        mean_pixel(own, sample_bits, n_channels, is_u8, transfer, pixel);
    }
}

/* n pixels from planes of colours that lie `stride` pixels apart. */
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
