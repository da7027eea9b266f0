/* Texels: an array of values sampled at (u, v), between its texels, and in mipmap levels where texels are smaller than
 * a pixel.
 * In: float32 values of any number of channels, coordinates of pixels and their derivatives.  Out: float32.
 *
 * Positions and weights are float64, and so are the sums, rounded once at the end.  shade/texture.c samples pictures of
 * four channels, with vectors of pixels.
 *
 * Based on: L. Williams, Pyramidal Parametrics, 1983; P. Heckbert, Fundamentals of Texture Mapping and Image Warping,
 * 1989 (the footprint of a pixel from derivatives). */
#ifndef TL_TEXELS_C
#define TL_TEXELS_C

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "lanes/lanes.h"
#include "pixels/shading.h"

/* A larger float64 has no fraction; NaN maps to texel 0. */
#define TL_LAST_FRACTION 0x1p52

/* The largest integer not above a. */
TL_INLINE int64_t floor_of(double a)
{
    if (!(a > -TL_LAST_FRACTION && a < TL_LAST_FRACTION))
        return a >= TL_LAST_FRACTION ? INT64_C(1) << 52 : a <= -TL_LAST_FRACTION ? -(INT64_C(1) << 52) : 0;
    const int64_t whole = (int64_t)a;
    return whole - (a < (double)whole);
}

/* log2 of positive numbers within 1e-10, by ln(m) = 2 atanh((m - 1) / (m + 1)), m from sqrt(1/2) to sqrt(2). */
TL_INLINE double log2_of(double a)
{
    int64_t bits;
    double m;
    memcpy(&bits, &a, 8);
    const int64_t exponent = (bits - INT64_C(0x3fe6a09e667f3bcd)) >> 52;
    bits -= exponent * (INT64_C(1) << 52);
    memcpy(&m, &bits, 8);
    const double t = (m - 1.0) / (m + 1.0), square = t * t;
    double sum = 1.0 / 11.0;
    sum = sum * square + 1.0 / 9.0;
    sum = sum * square + 1.0 / 7.0;
    sum = sum * square + 1.0 / 5.0;
    sum = sum * square + 1.0 / 3.0;
    sum = sum * square + 1.0;
    return (double)exponent + t * sum * 2.8853900817779268; /* 2 / ln 2 */
}

/* Folds a coordinate into the array, 0 to 1; a clamped coordinate is returned as it is. */
TL_INLINE double folded_to_array(double a, tl_wrap wrap)
{
    if (wrap == TL_WRAP_CLAMP)
        return a;
    const double period = wrap == TL_WRAP_REPEAT ? 1.0 : 2.0;
    if (!(a >= 0.0 && a < period)) {
        const double turns = a / period;
        const int has_fraction = turns > -TL_LAST_FRACTION && turns < TL_LAST_FRACTION;
        a -= has_fraction ? period * (double)floor_of(turns) : a;
    }
    return wrap == TL_WRAP_MIRROR && a > 1.0 ? 2.0 - a : a;
}

/* The texel, of n, of an index of a folded coordinate. */
TL_INLINE int64_t wrapped(int64_t index, int64_t n, tl_wrap wrap)
{
    if (index < 0)
        return wrap == TL_WRAP_REPEAT ? n - 1 : 0;
    if (index >= n)
        return wrap == TL_WRAP_REPEAT ? 0 : n - 1;
    return index;
}

/* The two texels of an axis next to a point, and the share of the second texel. */
typedef struct {
    int64_t first, second;
    double share;
} texel_ends;

TL_INLINE texel_ends ends_of(double x, int64_t n, tl_wrap wrap)
{
    const double at = x - 0.5;
    const int64_t left = floor_of(at);
    const int has_fraction = at > -TL_LAST_FRACTION && at < TL_LAST_FRACTION;
    return (texel_ends){wrapped(left, n, wrap), wrapped(left + 1, n, wrap), at - (has_fraction ? (double)left : at)};
}

/* Adds `share` of a level at (u, v) to the sums of channels [first, end). */
TL_INLINE void add_level(const tl_levels *t, int level, double u, double v, double share, int first, int end,
                         double *sums)
{
    const int64_t *row = t->rows + 3 * level, width = row[1], height = row[2], n = t->n_channels;
    const texel_ends x = ends_of(u * (double)width, width, t->wrap_u);
    const texel_ends y = ends_of(v * (double)height, height, t->wrap_v);
    const float *upper = t->texels + n * (row[0] + y.first * width) + first;
    const float *lower = t->texels + n * (row[0] + y.second * width) + first;
    const double w1 = share * (1.0 - y.share), w2 = share * y.share;
    for (int k = 0; k < end - first; k++) {
        const double a = (double)upper[n * x.first + k], b = (double)upper[n * x.second + k];
        const double c = (double)lower[n * x.first + k], d = (double)lower[n * x.second + k];
        sums[k] += w1 * (a * (1.0 - x.share) + b * x.share) + w2 * (c * (1.0 - x.share) + d * x.share);
    }
}

/* The mipmap level at which texels are as large as a pixel: log2 of the longer side of its footprint. */
TL_INLINE double level_of(const tl_levels *t, const float *slopes)
{
    const double width = (double)t->rows[1], height = (double)t->rows[2], last = (double)(t->n_levels - 1);
    double longer = 0.0;
    for (int axis = 0; axis < 2; axis++) {
        const double x = (double)slopes[axis] * width, y = (double)slopes[2 + axis] * height;
        const double square = x * x + y * y;
        longer = square > longer ? square : longer;
    }
    if (!(longer > 1.0)) /* larger texels, or NaN */
        return 0.0;
    const double level = longer < 0x1p1000 ? 0.5 * log2_of(longer) : last;
    return level < last ? level : last;
}

/* Channels that are summed at a time. */
#define TL_MAX_SUMS 16

/* Samples one pixel; v from the top down. */
TL_INLINE void look_up_one(const tl_levels *t, double u, double v, const float *slopes, float *out)
{
    u = folded_to_array(u, t->wrap_u), v = folded_to_array(v, t->wrap_v);
    const double level = t->n_levels > 1 ? level_of(t, slopes) : 0.0;
    if (t->filter == TL_FILTER_NEAREST || (t->filter == TL_FILTER_PIXELATED && level == 0.0)) {
        const int64_t width = t->rows[1], height = t->rows[2], n = t->n_channels;
        const int64_t x = wrapped(floor_of(u * (double)width), width, t->wrap_u);
        const int64_t y = wrapped(floor_of(v * (double)height), height, t->wrap_v);
        memcpy(out, t->texels + n * (y * width + x), (size_t)(4 * n));
        return;
    }
    const int fine = (int)level;
    const double share = level - (double)fine;
    for (int first = 0; first < t->n_channels; first += TL_MAX_SUMS) {
        const int rest = t->n_channels - first, end = first + (rest < TL_MAX_SUMS ? rest : TL_MAX_SUMS);
        double sums[TL_MAX_SUMS] = {0.0};
        add_level(t, fine, u, v, 1.0 - share, first, end, sums);
        if (share > 0.0)
            add_level(t, fine + 1, u, v, share, first, end, sums);
        for (int k = first; k < end; k++)
            out[k] = (float)sums[k - first];
    }
}

static void fill_texels(const tl_levels *t, const int32_t *ids, const float *uv, const float *slopes, float background,
                        int64_t n, float *out)
{
    for (int64_t i = 0; i < n; i++, out += t->n_channels) {
        if (ids[i] >= 0)
            look_up_one(t, (double)uv[2 * i], 1.0 - (double)uv[2 * i + 1], t->n_levels > 1 ? slopes + 4 * i : NULL,
                        out);
        else
            for (int k = 0; k < t->n_channels; k++)
                out[k] = background;
    }
}

static void levels_seen(const tl_levels *t, const float *slopes, int64_t n, double *out)
{
    for (int64_t i = 0; i < n; i++)
        out[i] = level_of(t, slopes + 4 * i);
}

/* The texels of an axis that texel i of the next level is the mean of, and their weights: 1 to 3 texels. */
typedef struct {
    int64_t first;
    int n;
    double weight[3];
} halving;

TL_INLINE halving halving_of(int64_t i, int64_t n)
{
    if (n == 1)
        return (halving){0, 1, {1.0}};
    if (n % 2 == 0)
        return (halving){2 * i, 2, {0.5, 0.5}};
    const double m = (double)(n / 2), whole = m / (double)n; /* of 2 m + 1 */
    return (halving){2 * i, 3, {whole * ((m - (double)i) / m), whole, whole * ((double)(i + 1) / m)}};
}

/* `out` is the mean over the area of a texel.  No side is below 1. */
static void halve_rows(const float *level, int64_t width, int64_t height, int n_channels, int64_t first, int64_t end,
                       float *out)
{
    const int64_t half = width > 1 ? width / 2 : 1, n = n_channels;
    for (int64_t row = first; row < end; row++) {
        const halving y = halving_of(row, height);
        for (int64_t column = 0; column < half; column++) {
            const halving x = halving_of(column, width);
            for (int64_t k = 0; k < n; k++) {
                double sum = 0.0;
                for (int j = 0; j < y.n; j++) {
                    const float *texel = level + n * ((y.first + j) * width + x.first) + k;
                    double along = 0.0;
                    for (int i = 0; i < x.n; i++)
                        along += x.weight[i] * (double)texel[n * i];
                    sum += y.weight[j] * along;
                }
                out[(row * half + column) * n + k] = (float)sum;
            }
        }
    }
}

/* Adds row i of n to the row of the next level that it is a part of, which `sum` has so far.  Returns whether it is the
 * last part: `row` is then the row of the next level. */
static bool add_texel_row(double *restrict row, int64_t i, int64_t n, int64_t n_numbers, double *restrict sum)
{
    if (n == 1)
        return true;
    const halving last = halving_of((i - 1) / 2, n), next = halving_of(i / 2, n);
    const int64_t k = i - last.first;
    const bool is_first = i == next.first && i < n - 1;
    for (int64_t j = 0; j < n_numbers; j++) {
        const double value = row[j];
        row[j] = sum[j] + last.weight[k] * value;
        sum[j] = is_first ? next.weight[0] * value : row[j];
    }
    return i > 0 && k == last.n - 1;
}

static void halve_texel_row(const double *restrict row, int64_t n, double *restrict out)
{
    for (int64_t i = 0; i < (n > 1 ? n / 2 : 1); i++, out += 4) {
        const halving x = halving_of(i, n);
        const double *const texel = row + 4 * x.first;
        for (int k = 0; k < 4; k++)
            out[k] = x.weight[0] * texel[k];
        for (int j = 1; j < x.n; j++)
            for (int k = 0; k < 4; k++)
                out[k] += x.weight[j] * texel[4 * j + k];
    }
}

/* A row of texels in 65535ths, and its first texel again. */
static void write_texel_row(const double *restrict row, int64_t n, uint16_t *restrict out)
{
    for (int64_t j = 0; j < 4 * n; j++)
        out[j] = (uint16_t)(int32_t)(65535.0 * row[j] + TL_LAST_FRACTION - TL_LAST_FRACTION); /* halves to even */
    memcpy(out + 4 * n, out, 4 * sizeof *out);
}

static void write_levels(const tl_picture_levels *picture, int64_t first, int64_t end)
{
    const int64_t width = picture->levels[1], height = picture->levels[2];
    for (int64_t y = first; y < end; y++) {
        const uint8_t *const bytes = picture->image + 4 * width * (height - 1 - y);
        double *row = picture->room;
        for (int64_t j = 0; j < 4 * width; j++)
            row[j] = picture->light[(j % 4 == 3 ? 256 : 0) + bytes[j]];
        for (int k = 0;; k++) {
            const int32_t *const level = picture->levels + 3 * k;
            const int64_t i = picture->n_written[k]++, n = level[1];
            write_texel_row(row, n, picture->texels + 4 * (level[0] + i * (n + 1)));
            if (k + 1 == picture->n_levels || !add_texel_row(row, i, level[2], 4 * n, row + 4 * n))
                break;
            halve_texel_row(row, n, row + 8 * n);
            row += 8 * n;
        }
    }
}

#endif
