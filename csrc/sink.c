/* Sinks: what a covered span does to the buffers.  The walkers know nothing of what is drawn.
 * In: a triangle and a span of samples.  Out: mask, counts, ids and depth, or colours. */
#include <string.h>

#include "fixed.h"

/* Samples interpolated at a time: two arrays of weights stay in the first-level cache. */
#define TL_CHUNK 64

static inline void set_plane(tl_triangle *t, int i, double v0, double v1, double v2)
{
    t->value0[i] = v0;
    t->slope1[i] = (v1 - v0) / t->w_sum;
    t->slope2[i] = (v2 - v0) / t->w_sum;
}

/* What the sink needs of a triangle beyond its spans. */
static inline void setup_sink(tl_triangle *t, const tl_window *window, const tl_target *target)
{
    const int channels = target->n_channels;
    const uint8_t *bytes = target->colors;
    const float *floats = target->colors;
    int64_t at[3];
    switch (target->sink) {
    case TL_SINK_MASK:
    case TL_SINK_COUNT:
    case TL_SINK_FLAT: return;
    case TL_SINK_ID:
    case TL_SINK_NEAREST:
    case TL_SINK_FARTHEST:
        setup_weights(t, window);
        set_plane(t, 0, t->z[0], t->z[1], t->z[2]);
        return;
    default: break;
    }
    setup_weights(t, window);
    for (int k = 0; k < 3; k++)
        at[k] = (int64_t)t->corner[k] * channels;
    for (int c = 0; c < channels; c++) {
        if (target->sink == TL_SINK_GOURAUD_U8)
            set_plane(t, c, bytes[at[0] + c], bytes[at[1] + c], bytes[at[2] + c]);
        else
            set_plane(t, c, floats[at[0] + c], floats[at[1] + c], floats[at[2] + c]);
    }
}

static inline void put_depths(const tl_triangle *t, tl_sink sink, const double *restrict w1, const double *restrict w2, int n,
                              int32_t *restrict ids, float *restrict depth)
{
    const double z0 = t->value0[0], slope1 = t->slope1[0], slope2 = t->slope2[0];
    float z[TL_CHUNK];
    for (int k = 0; k < n; k++)
        z[k] = (float)(z0 + (w1[k] * slope1 + w2[k] * slope2)) + 0.0f; /* + 0 makes -0 a 0 */
    /* stores without a branch: the compiler turns them into vector blends */
    if (sink == TL_SINK_NEAREST) {
        for (int k = 0; k < n; k++) {
            const int wins = z[k] < depth[k];
            ids[k] = wins ? t->id : ids[k];
            depth[k] = wins ? z[k] : depth[k];
        }
    } else if (sink == TL_SINK_FARTHEST) {
        for (int k = 0; k < n; k++) {
            const int wins = z[k] > depth[k];
            ids[k] = wins ? t->id : ids[k];
            depth[k] = wins ? z[k] : depth[k];
        }
    } else {
        for (int k = 0; k < n; k++) {
            ids[k] = t->id;
            depth[k] = z[k];
        }
    }
}

static inline void put_flat(const uint8_t *color, int pixel_bytes, int64_t n, uint8_t *out)
{
    switch (pixel_bytes) {
    case 1: memset(out, color[0], (size_t)n); return;
    case 3:
        for (int64_t k = 0; k < n; k++)
            memcpy(out + 3 * k, color, 3);
        return;
    case 4:
        for (int64_t k = 0; k < n; k++)
            memcpy(out + 4 * k, color, 4);
        return;
    default:
        for (int64_t k = 0; k < n; k++)
            memcpy(out + k * pixel_bytes, color, (size_t)pixel_bytes);
    }
}

/* Sign of w1*d1 + w2*d2 - half_sum * w_sum / 2 in exact integers; |d|, |half_sum| <= 511. */
static int compare_exactly(const tl_triangle *t, const tl_window *window, int64_t row, int64_t col, int d1, int d2, int half_sum)
{
    const tl_int128 terms[3] = {
        doubled_edge(t, 2, 0, col + window->x_px, row + window->y_px, window->subpixel_bits),
        doubled_edge(t, 0, 1, col + window->x_px, row + window->y_px, window->subpixel_bits),
        weight_sum(t),
    };
    const int factors[3] = {2 * d1, 2 * d2, -half_sum};
    tl_int128 high = 0, low = 0; /* the terms reach 2^127: two limbs */
    for (int k = 0; k < 3; k++) {
        high += (terms[k] >> 64) * factors[k];
        low += (tl_int128)(uint64_t)terms[k] * factors[k];
    }
    high += low >> 64;
    low = (tl_int128)(uint64_t)low;
    return high < 0 ? -1 : high > 0 || low > 0;
}

/* The exact interpolated value rounded to nearest, ties to even.  float64 decides unless it is next to a tie. */
static inline void put_gouraud_u8(const tl_triangle *t, const tl_window *window, const tl_target *target, int64_t row, int64_t col,
                                  const double *restrict w1, const double *restrict w2, int n, uint8_t *restrict out)
{
    const int channels = target->n_channels;
    const uint8_t *colors = target->colors;
    for (int c = 0; c < channels; c++) {
        const int c0 = colors[(int64_t)t->corner[0] * channels + c];
        const int d1 = colors[(int64_t)t->corner[1] * channels + c] - c0, d2 = colors[(int64_t)t->corner[2] * channels + c] - c0;
        const double slope1 = t->slope1[c], slope2 = t->slope2[c];
        int near_tie = 0;
        for (int k = 0; k < n; k++) {
            const double value = c0 + (w1[k] * slope1 + w2[k] * slope2), floor_value = floor(value);
            near_tie |= fabs(value - floor_value - 0.5) < 0x1p-20;
            out[k * channels + c] = (uint8_t)rint(value);
        }
        for (int k = 0; near_tie && k < n; k++) {
            const double value = c0 + (w1[k] * slope1 + w2[k] * slope2);
            const int below = (int)floor(value);
            if (!(fabs(value - below - 0.5) < 0x1p-20))
                continue;
            const int side = compare_exactly(t, window, row, col + k, d1, d2, 2 * (below - c0) + 1);
            out[k * channels + c] = (uint8_t)(below + (side > 0 || (side == 0 && (below & 1))));
        }
    }
}

static inline void put_gouraud_f32(const tl_triangle *t, const tl_target *target, const double *restrict w1,
                                   const double *restrict w2, int n, float *restrict out)
{
    const int channels = target->n_channels;
    for (int c = 0; c < channels; c++) {
        const double c0 = t->value0[c], slope1 = t->slope1[c], slope2 = t->slope2[c];
        for (int k = 0; k < n; k++)
            out[k * channels + c] = (float)(c0 + (w1[k] * slope1 + w2[k] * slope2));
    }
}

static inline void put_interpolated(const tl_triangle *t, const tl_window *window, const tl_target *target, int64_t row,
                                    int64_t first, int64_t end)
{
    double w1[TL_CHUNK], w2[TL_CHUNK];
    for (int64_t col = first; col < end; col += TL_CHUNK) {
        const int n = (int)min64(end - col, TL_CHUNK);
        const int64_t at = row * target->stride_px + col;
        weights_at(t, window, row, col, n, w1, w2);
        if (target->sink == TL_SINK_GOURAUD_U8)
            put_gouraud_u8(t, window, target, row, col, w1, w2, n, (uint8_t *)target->pixels + at * target->n_channels);
        else if (target->sink == TL_SINK_GOURAUD_F32)
            put_gouraud_f32(t, target, w1, w2, n, (float *)target->pixels + at * target->n_channels);
        else
            put_depths(t, target->sink, w1, w2, n, (int32_t *)target->pixels + at, target->depth + at);
    }
}

/* Draws the samples [first, end) of a row; the window's own columns and rows. */
static inline void put_span(const tl_triangle *t, const tl_window *window, const tl_target *target, int64_t row, int64_t first,
                            int64_t end)
{
    const int64_t at = row * target->stride_px + first;
    switch (target->sink) {
    case TL_SINK_MASK: memset((uint8_t *)target->pixels + at, 1, (size_t)(end - first)); return;
    case TL_SINK_COUNT:
        for (int64_t k = 0; k < end - first; k++)
            ((int32_t *)target->pixels)[at + k]++;
        return;
    case TL_SINK_FLAT:
        put_flat((const uint8_t *)target->colors + (int64_t)t->id * target->pixel_bytes, target->pixel_bytes, end - first,
                 (uint8_t *)target->pixels + at * target->pixel_bytes);
        return;
    default: put_interpolated(t, window, target, row, first, end);
    }
}
