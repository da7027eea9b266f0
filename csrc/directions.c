/* Directions: rows of three numbers as unit vectors, turned, moved, and as the rows of four that shading reads.
 * In: vectors, positions or colours of a mesh.  Out: float64 (n, 3), or float32 (n, 4) whose last number is 1.
 *
 * Nothing but sums, products, quotients and roots, each rounded once, in the order that is written: the same bits everywhere. */
#include "fixed.h"
#include "lanes.h"

/* The powers of two, 2^-1 to 2^1022, that take numbers up to 2^1022 to [1/2, 1): products with them are exact but for what is lost
 * below 2^-1074; and what undoes them. */
TL_INLINE vd power_to_one(vd a) { return vd_power(a, 2045ull << 52, 2047ull << 52); }
TL_INLINE vd power_from_one(vd power) { return vd_power(power, 2046ull << 52, 2047ull << 52); }

TL_INLINE vd largest_of(const vd *v) { return vd_max(vd_max(vd_abs(v[0]), vd_abs(v[1])), vd_abs(v[2])); }

TL_INLINE vd dot_of(const vd *a, const vd *b) { return vd_add(vd_add(vd_mul(a[0], b[0]), vd_mul(a[1], b[1])), vd_mul(a[2], b[2])); }

/* Vectors, of numbers below 2^1022, scaled to length 1, however long they are; zero stays zero.  Returns their lengths. */
TL_INLINE vd to_unit(vd *v)
{
    const vd power = power_to_one(largest_of(v));
    for (int k = 0; k < 3; k++)
        v[k] = vd_mul(v[k], power);
    const vd length = vd_sqrt(dot_of(v, v));
    const vm is_any = vd_ge(length, vd_set1(0x1p-60)); /* the largest number is 2^-52 or more, then */
    const vd divisor = vd_select(is_any, length, vd_set1(1.0));
    for (int k = 0; k < 3; k++)
        v[k] = vd_select(is_any, vd_div(v[k], divisor), vd_set1(0.0));
    return vd_mul(length, power_from_one(power));
}

static inline void load_three(const tl_source *source, int64_t i, double *p)
{
    for (int k = 0; k < 3; k++)
        p[k] = source->scalar == TL_F32 ? (double)((const float *)source->data)[3 * i + k] : ((const double *)source->data)[3 * i + k];
}

#define TL_DIRECTIONS 64 /* at a time, whole vectors of lanes */

/* What squares of would overflow is made smaller, what is not finite zero. */
static void gather_vectors(const tl_source *vectors, int64_t first, int n, double (*v)[TL_DIRECTIONS])
{
    for (int i = 0; i < n; i++) {
        double p[3];
        load_three(vectors, first + i, p);
        const double far = (fabs(p[0]) + fabs(p[1])) + fabs(p[2]);
        const int is_finite = (fabs(p[0]) <= DBL_MAX) & (fabs(p[1]) <= DBL_MAX) & (fabs(p[2]) <= DBL_MAX);
        for (int k = 0; k < 3; k++)
            v[k][i] = far <= 0x1p1000 ? p[k] : is_finite ? p[k] * 0x1p-60 : 0.0;
    }
}

TL_INLINE void unit_block(const double *turn, int n, double (*block)[TL_DIRECTIONS])
{
    for (int i = 0; i < n; i += TL_LANES) {
        vd v[3];
        for (int k = 0; k < 3; k++)
            v[k] = vd_load(block[k] + i);
        if (turn) {
            const vd own[3] = {v[0], v[1], v[2]};
            for (int k = 0; k < 3; k++) {
                const vd column[3] = {vd_set1(turn[k]), vd_set1(turn[3 + k]), vd_set1(turn[6 + k])};
                v[k] = dot_of(own, column);
            }
        }
        to_unit(v);
        for (int k = 0; k < 3; k++)
            vd_store(block[k] + i, v[k]);
    }
}

static inline void store_rows(double (*v)[TL_DIRECTIONS], int n, int64_t first, double *out, float *rows)
{
    for (int i = 0; out && i < n; i++)
        for (int k = 0; k < 3; k++)
            out[3 * (first + i) + k] = v[k][i];
    for (int i = 0; rows && i < n; i++) {
        float *row = rows + 4 * (first + i);
        row[0] = (float)v[0][i], row[1] = (float)v[1][i], row[2] = (float)v[2][i], row[3] = 1.0f;
    }
}

static void unit_vectors(const tl_source *vectors, const double *turn, int64_t first, int64_t end, double *out, float *rows)
{
    double v[3][TL_DIRECTIONS] = {{0.0}};
    for (int64_t i = first; i < end; i += TL_DIRECTIONS) {
        const int n = (int)(end - i < TL_DIRECTIONS ? end - i : TL_DIRECTIONS);
        gather_vectors(vectors, i, n, v);
        if (turn)
            unit_block(turn, n, v);
        else
            unit_block(NULL, n, v);
        store_rows(v, n, i, out, rows);
    }
}

static void move_points(const tl_source *points, const double *matrix, int64_t first, int64_t end, double *out)
{
    for (int64_t i = first; i < end; i++) {
        double p[3];
        load_three(points, i, p);
        for (int k = 0; k < 3; k++) {
            const double *row = matrix + 4 * k;
            out[3 * i + k] = ((p[0] * row[0] + p[1] * row[1]) + p[2] * row[2]) + row[3];
        }
    }
}

static void color_rows(const uint8_t *colors, int n_channels, int64_t first, int64_t end, float *rows)
{
    for (int64_t i = first; i < end; i++) {
        const uint8_t *color = colors + n_channels * i;
        float *row = rows + 4 * i;
        row[0] = (float)color[0], row[1] = (float)color[1], row[2] = (float)color[2], row[3] = 1.0f;
    }
}
