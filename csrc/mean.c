/* Mean: the colour of a pixel from those of its samples, all with the same weight (a box filter one pixel wide).
 * In: the label of each sample, or colours of samples.  Out: colours; a sample with label -1 counts as what the pixel holds.
 *
 * uint8: the mean rounded to nearest, ties to even.  float32: summed in float64 in the order of the samples, rounded once. */
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

TL_INLINE float mean_f32(const float *values, int sample_bits)
{
    double sum = 0.0;
    for (int k = 0; k < 1 << sample_bits; k++)
        sum += (double)values[k];
    return (float)(sum / (double)(1 << sample_bits));
}

/* One pixel: the colour of sample k stands at colors[k]. */
TL_INLINE void mean_pixel(const void *const *colors, int sample_bits, int n_channels, int is_u8, const tl_transfer *transfer, void *pixel)
{
    for (int c = 0; c < n_channels; c++) {
        uint8_t bytes[TL_MAX_SAMPLES];
        float floats[TL_MAX_SAMPLES];
        for (int k = 0; k < 1 << sample_bits; k++) {
            if (is_u8)
                bytes[k] = ((const uint8_t *)colors[k])[c];
            else
                floats[k] = ((const float *)colors[k])[c];
        }
        if (is_u8)
            ((uint8_t *)pixel)[c] = mean_u8(bytes, sample_bits, transfer && c < transfer->n_channels ? transfer : NULL);
        else
            ((float *)pixel)[c] = mean_f32(floats, sample_bits);
    }
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
