/* Take: checks vertices and converts them to float64, as they are or rounded to a grid.
 * In: the caller's numbers.  Out: points, and how many of the numbers cannot be drawn. */
#ifndef TL_TAKE_POINTS_C
#define TL_TAKE_POINTS_C

#include <float.h>
#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "vertex/fixed.h"

static int64_t take_f32(const float *v, int64_t n, double *out)
{
    int64_t n_bad = 0;
    for (int64_t i = 0; i < n; i++) { /* without a branch, so that the compiler vectorises */
        n_bad += !(fabsf(v[i]) <= FLT_MAX);
        out[i] = (double)v[i];
    }
    return n_bad;
}

static int64_t take_i64(const int64_t *v, int64_t n, double *out)
{
    const int64_t most = (int64_t)1 << 53;
    int64_t n_bad = 0;
    for (int64_t i = 0; i < n; i++) {
        n_bad += v[i] > most || v[i] < -most;
        out[i] = (double)v[i];
    }
    return n_bad;
}

/* float64 is checked in place. */
static int64_t look_at_f64(const double *v, int64_t n, int n_components)
{
    int64_t n_bad = 0;
    for (int64_t i = 0; i < n; i++, v += n_components) {
        n_bad += !(fabs(v[0]) <= DBL_MAX) + !(fabs(v[1]) <= DBL_MAX);
        if (n_components > 2)
            n_bad += !(fabs(v[2]) <= FLT_MAX);
    }
    return n_bad;
}

/* Rounds n numbers to a grid as snap.c does, so in its range; a power of two scales without loss. */
static int64_t take_on_grid(const tl_source *source, int64_t at, int64_t n, int bits, double *out)
{
    const double scale = (double)(1 << bits), inverse = 1.0 / scale;
    const float *v32 = (const float *)source->data + at;
    const double *v64 = (const double *)source->data + at;
    const int64_t *integers = (const int64_t *)source->data + at;
    int64_t n_bad = 0;
    if (source->scalar == TL_F32)
        for (int64_t i = 0; i < n; i++) {
            const double x_fx = rint((double)v32[i] * scale);
            n_bad += !(fabs(x_fx) < TL_WIDE_LIMIT);
            out[i] = x_fx * inverse;
        }
    else if (source->scalar == TL_F64)
        for (int64_t i = 0; i < n; i++) {
            const double x_fx = rint(v64[i] * scale);
            n_bad += !(fabs(x_fx) < TL_WIDE_LIMIT);
            out[i] = x_fx * inverse;
        }
    else
        for (int64_t i = 0; i < n; i++) {
            n_bad += !(fabs((double)integers[i]) < 0x1p46);
            out[i] = (double)integers[i];
        }
    return n_bad;
}

static int64_t take_points(const tl_source *source, int64_t first, int64_t end, int bits, double *points)
{
    const int64_t at = first * source->n_components, n = (end - first) * source->n_components;
    if (bits >= 0)
        return take_on_grid(source, at, n, bits, points + at);
    switch (source->scalar) {
    case TL_F32: return take_f32((const float *)source->data + at, n, points + at);
    case TL_I64: return take_i64((const int64_t *)source->data + at, n, points + at);
    default: return look_at_f64((const double *)source->data + at, end - first, source->n_components);
    }
}

#endif
