/* Take: vertices as they are, as float64, looked at once.  In: the caller's numbers.  Out: the same, and how many of
 * them cannot be drawn. */
#ifndef TL_TAKE_POINTS_C
#define TL_TAKE_POINTS_C

#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>

#include "topleft.h"

static int64_t take_f32(const float *v, int64_t n, double *out)
{
    int64_t n_bad = 0;
    for (int64_t i = 0; i < n; i++) { /* the compiler makes vectors of it */
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

/* float64 is taken where it lies. */
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

static int64_t take_points(const tl_source *source, int64_t first, int64_t end, double *points)
{
    const int64_t at = first * source->n_components, n = (end - first) * source->n_components;
    switch (source->scalar) {
    case TL_F32: return take_f32((const float *)source->data + at, n, points + at);
    case TL_I64: return take_i64((const int64_t *)source->data + at, n, points + at);
    default: return look_at_f64((const double *)source->data + at, end - first, source->n_components);
    }
}

#endif
