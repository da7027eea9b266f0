/* Paint: colours from labels, once per visible sample.
 * In: the label of each sample and the colours of triangles or vertices.  Out: colours; samples with label -1 are kept.
 * Based on: H. Gouraud, Continuous Shading of Curved Surfaces, 1971. */
#ifndef TL_PAINT_C
#define TL_PAINT_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/exact.h"
#include "vertex/fixed.h"
#include "vertex/setup.c"
#include "sink/sink.c"
#include "pixels/weights_exact.c"
#include "pixels/weights_one.c"

/* Paints whole vectors of samples with colours of four bytes; returns how many samples. */
TL_INLINE int64_t paint_words(const int32_t *labels, int64_t n, const uint8_t *colors, const uint8_t *ground,
                              uint8_t *restrict out)
{
    int32_t under = 0;
    int64_t k = 0;
    if (ground)
        memcpy(&under, ground, 4);
    for (; TL_LANES > 1 && k + TL_LANES <= n; k += TL_LANES) {
        const vi label = vi_load(labels + k);
        const vm m = vi_gt(label, vi_set1(-1));
        int32_t *const to = (int32_t *)(out + 4 * k);
        if (ground)
            vi_store(to, vi_select(m, vi_gather(m, (const int32_t *)colors, label), vi_set1(under)));
        else if (vm_any(m))
            vi_store_some(to, m, vi_gather(m, (const int32_t *)colors, label), 1);
    }
    return k;
}

/* Paints samples from k on, of n_bytes each. */
TL_INLINE void paint_bytes(const int32_t *labels, int64_t k, int64_t n, const uint8_t *colors, const uint8_t *ground,
                           uint8_t *restrict out, const size_t n_bytes)
{
    for (; k < n; k++) {
        const uint8_t *from = labels[k] < 0 ? ground : colors + (size_t)labels[k] * n_bytes;
        if (from)
            memcpy(out + (size_t)k * n_bytes, from, n_bytes);
    }
}

static void paint_flat(const int32_t *labels, int64_t n, const uint8_t *colors, int pixel_bytes, const uint8_t *ground,
                       uint8_t *restrict out)
{
    switch (pixel_bytes) {
    case 1: paint_bytes(labels, 0, n, colors, ground, out, 1); return;
    case 3: paint_bytes(labels, 0, n, colors, ground, out, 3); return;
    case 4: paint_bytes(labels, paint_words(labels, n, colors, ground, out), n, colors, ground, out, 4); return;
    default: paint_bytes(labels, 0, n, colors, ground, out, (size_t)pixel_bytes);
    }
}

/* Sign of w1 * d1 + w2 * d2 - halves * w_sum / 2 in exact integers; |d|, |halves| <= 511. */
static int compare_exactly(const tl_triangle *t, int64_t x_px, int64_t y_px, int bits, int d1, int d2, int halves)
{
    const tl_int128 terms[3] = {doubled_edge(t, 2, 0, x_px, y_px, bits), doubled_edge(t, 0, 1, x_px, y_px, bits),
                                weight_sum(t)};
    const int factors[3] = {2 * d1, 2 * d2, -halves};
    tl_int128 high = i128_from(0), low = high; /* high 2^64 + low: the terms reach 2^127 */
    for (int k = 0; k < 3; k++) {
        high = i128_add(high, i128_times(i128_shift_right(terms[k], 64), factors[k]));
        low = i128_add(low, i128_times(i128_from_u64((uint64_t)i128_low(terms[k])), factors[k]));
    }
    high = i128_add(high, i128_shift_right(low, 64));
    return i128_is_zero(high) ? i128_low(low) != 0 : i128_sign(high);
}

/* Sign of w1 * d1 + w2 * d2 - halves * w_sum / 2, exact, for vertices that are not snapped. */
static int compare_points(const resolve_state *s, int64_t x_px, int64_t y_px, int bits, int d1, int d2, int halves)
{
    const exact_point *p = s->points, sample = sample_of(s->exact, x_px, y_px, bits);
    const edge_term terms[3] = {
        {p[2], p[0], sample, 2 * d1}, {p[0], p[1], sample, 2 * d2}, {p[0], p[1], p[2], -halves}};
    return terms_sign(terms, 3) * edge_sign(p[0], p[1], p[2]);
}

/* The exact value of a channel rounded to nearest, ties to even; `value`, which errs by less than 2^-20, suffices
 * unless it is close to a tie. */
static inline uint8_t round_color(const resolve_state *s, int64_t x_px, int64_t y_px, int bits, int c0, int d1, int d2,
                                  double value)
{
    const int below = (int)floor(value);
    if (!(fabs(value - below - 0.5) < 0x1p-20)) /* or NaN, of a triangle that has changed */
        return (uint8_t)(int)rint(value);
    const int halves = 2 * (below - c0) + 1;
    const int side = s->exact ? compare_points(s, x_px, y_px, bits, d1, d2, halves)
                              : compare_exactly(&s->triangle, x_px, y_px, bits, d1, d2, halves);
    return (uint8_t)(below + (side > 0 || (side == 0 && (below & 1))));
}

/* One channel of n samples; w1 and w2 have the sum of weights w_sum. */
static inline void paint_run_u8(const resolve_state *s, const uint8_t *c, int64_t x_px, int64_t y_px, int bits,
                                const double *w1, const double *w2, double w_sum, int n, int n_channels,
                                uint8_t *restrict out)
{
    const int c0 = c[0], d1 = c[1] - c0, d2 = c[2] - c0;
    const double slope1 = d1 / w_sum, slope2 = d2 / w_sum;
    for (int k = 0; k < n; k++)
        out[k * n_channels] = round_color(s, x_px + k, y_px, bits, c0, d1, d2, c0 + (w1[k] * slope1 + w2[k] * slope2));
}

static inline void paint_run_f32(const float *c, const double *w1, const double *w2, double w_sum, int n,
                                 int n_channels, float *restrict out)
{
    const double c0 = c[0], slope1 = (c[1] - c0) / w_sum, slope2 = (c[2] - c0) / w_sum;
    for (int k = 0; k < n; k++)
        out[k * n_channels] = (float)(c0 + (w1[k] * slope1 + w2[k] * slope2));
}

/* A sample of a piece: the colours of its corners are interpolated at the cut points. */
static void paint_piece(const resolve_state *s, const int32_t *corners, int64_t x_px, int64_t y_px, int bits,
                        const void *colors, int n_channels, int is_u8, void *out)
{
    double part[3], sum = 0.0;
    edges_of_pixel(s, x_px, y_px, bits, part);
    for (int k = 0; k < 3; k++) {
        if (!s->exact) /* a piece may cover a pixel but not its centre */
            part[k] = part[k] > 0.0 ? part[k] : 0.0;
        sum += part[k];
    }
    for (int c = 0; c < n_channels; c++) {
        double value = 0.0;
        for (int j = 0; j < 3; j++) {
            const int64_t at = (int64_t)corners[j] * n_channels + c;
            const double weight =
                (part[0] * s->piece[0][j] + part[1] * s->piece[1][j] + part[2] * s->piece[2][j]) / sum;
            value += weight * (is_u8 ? (double)((const uint8_t *)colors)[at] : (double)((const float *)colors)[at]);
        }
        if (is_u8)
            ((uint8_t *)out)[c] = (uint8_t)rint(value < 0.0 ? 0.0 : value > 255.0 ? 255.0 : value);
        else
            ((float *)out)[c] = (float)value;
    }
}

/* The weights of corners 1 and 2 at n samples of a triangle that is not snapped; weights sum to 1. */
static void exact_weights_at(const resolve_state *s, int64_t x_px, int64_t y_px, int bits, int n, double *w1,
                             double *w2)
{
    const exact_point *p = s->points, first = sample_of(s->exact, x_px, y_px, bits);
    double area;
    if (has_float_weights(p, &area)) {
        const double inverse = 1.0 / area, dx1 = p[0].x - p[2].x, dy1 = p[0].y - p[2].y;
        const double dx2 = p[1].x - p[0].x, dy2 = p[1].y - p[0].y;
        const double row1 = dx1 * (first.y - p[2].y), row2 = dx2 * (first.y - p[0].y);
        for (int k = 0; k < n; k++) {
            const double x = first.x + (double)k;
            w1[k] = (row1 - dy1 * (x - p[2].x)) * inverse;
            w2[k] = (row2 - dy2 * (x - p[0].x)) * inverse;
        }
        return;
    }
    for (int k = 0; k < n; k++) {
        double e[3];
        edges_of_pixel(s, x_px + k, y_px, bits, e);
        const double inverse = 1.0 / ((e[0] + e[1]) + e[2]);
        w1[k] = e[1] * inverse, w2[k] = e[2] * inverse;
    }
}

/* Paints n samples of one triangle in a row. */
static void paint_run(resolve_state *s, const tl_window *window, int64_t row, int64_t col, int n, const void *colors,
                      int n_channels, int is_u8, void *out)
{
    double w1[TL_CHUNK], w2[TL_CHUNK];
    tl_triangle *t = &s->triangle;
    const int bits = window->subpixel_bits;
    const int64_t x_px = col + window->x_px, y_px = row + window->y_px;
    double w_sum = 1.0;
    if (s->exact) {
        exact_weights_at(s, x_px, y_px, bits, n, w1, w2);
    } else {
        t->row0 = row, t->col0 = col;
        setup_weights(t, window);
        weights_at(t, window, row, col, n, w1, w2);
        w_sum = t->w_sum;
    }
    for (int c = 0; c < n_channels; c++) {
        const int64_t at[3] = {(int64_t)t->corner[0] * n_channels + c, (int64_t)t->corner[1] * n_channels + c,
                               (int64_t)t->corner[2] * n_channels + c};
        if (is_u8) {
            const uint8_t *all = colors, own[3] = {all[at[0]], all[at[1]], all[at[2]]};
            paint_run_u8(s, own, x_px, y_px, bits, w1, w2, w_sum, n, n_channels, (uint8_t *)out + c);
        } else {
            const float *all = colors, own[3] = {all[at[0]], all[at[1]], all[at[2]]};
            paint_run_f32(own, w1, w2, w_sum, n, n_channels, (float *)out + c);
        }
    }
}

static void paint_gouraud(const tl_snapped *snapped, const tl_window *window, const int32_t *labels, const void *colors,
                          int n_channels, int is_u8, void *pixels)
{
    resolve_state s = {.id = -1};
    const int pixel_bytes = n_channels * (is_u8 ? 1 : 4), bits = window->subpixel_bits;
    for (int64_t row = 0; row < window->height; row++) {
        const int32_t *label = labels + row * window->width;
        char *out = (char *)pixels + row * window->width * pixel_bytes;
        for (int64_t col = 0, n; col < window->width; col += n) {
            for (n = 1; n < TL_CHUNK && col + n < window->width && label[col + n] == label[col];)
                n++;
            const int64_t id = label[col], x_px = col + window->x_px, y_px = row + window->y_px;
            int32_t corners[3];
            if (id < 0 || !find_triangle(&s, snapped, id, x_px, y_px, bits))
                continue;
            if (!s.piece[0]) {
                paint_run(&s, window, row, col, (int)n, colors, n_channels, is_u8, out + col * pixel_bytes);
                continue;
            }
            n = 1; /* the next sample may be in another piece */
            read_corners(snapped, id, corners);
            paint_piece(&s, corners, x_px, y_px, bits, colors, n_channels, is_u8, out + col * pixel_bytes);
        }
    }
}

#endif
