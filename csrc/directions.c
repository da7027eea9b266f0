/* Directions: rows of three numbers as unit vectors, turned, moved, and as the rows of four that shading reads.
 * In: vectors, positions or colours of a mesh.  Out: float64 (n, 3), or float32 (n, 4) whose last number is 1.
 *
 * Nothing but sums, products, quotients and roots, each rounded once, in the order that is written: the same bits everywhere. */
#include <string.h>

#include "fixed.h"
#include "lanes.h" /* TL_INLINE */

/* The power of two, 2^-1 to 2^1022, that takes a number up to 2^1022 to [1/2, 1): products with it are exact but for what is lost
 * below 2^-1074. */
TL_INLINE double power_to_one(double a)
{
    uint64_t bits;
    memcpy(&bits, &a, sizeof bits);
    bits = (2045ull << 52) - (bits & 2047ull << 52);
    memcpy(&a, &bits, sizeof bits);
    return a;
}

/* What undoes it. */
TL_INLINE double power_from_one(double power)
{
    uint64_t bits;
    memcpy(&bits, &power, sizeof bits);
    bits = (2046ull << 52) - bits;
    memcpy(&power, &bits, sizeof bits);
    return power;
}

TL_INLINE double larger(double a, double b) { return a > b ? a : b; }
TL_INLINE double largest_of(double x, double y, double z) { return larger(larger(fabs(x), fabs(y)), fabs(z)); }

/* The vector, of numbers below 2^1022, scaled to length 1, however long it is; zero, and what is not a number, become zero.  Returns
 * its length. */
TL_INLINE double to_unit(double *x, double *y, double *z)
{
    const double power = power_to_one(largest_of(*x, *y, *z)), a = *x * power, b = *y * power, c = *z * power;
    const double length = sqrt((a * a + b * b) + c * c);
    const double divisor = length > 0.0 ? length : 1.0, unit_x = a / divisor, unit_y = b / divisor, unit_z = c / divisor;
    *x = length > 0.0 ? unit_x : 0.0;
    *y = length > 0.0 ? unit_y : 0.0;
    *z = length > 0.0 ? unit_z : 0.0;
    return length * power_from_one(power);
}

static inline void load_three(const tl_source *source, int64_t i, double *p)
{
    for (int k = 0; k < 3; k++)
        p[k] = source->scalar == TL_F32 ? (double)((const float *)source->data)[3 * i + k] : ((const double *)source->data)[3 * i + k];
}

#define TL_DIRECTIONS 64 /* at a time: vectors of them stay in the first-level cache */

TL_INLINE void unit_block(const tl_source *vectors, const double *turn, int64_t first, int n, double (*out)[TL_DIRECTIONS])
{
    for (int i = 0; i < n; i++) {
        double p[3];
        load_three(vectors, first + i, p);
        for (int k = 0; k < 3; k++)
            out[k][i] = p[k];
    }
    for (int i = 0; i < n; i++) {
        double x = out[0][i], y = out[1][i], z = out[2][i];
        const double far = largest_of(x, y, z), near = far > 0x1p1000 ? 0x1p-60 : 1.0;
        const int is_finite = (fabs(x) <= DBL_MAX) & (fabs(y) <= DBL_MAX) & (fabs(z) <= DBL_MAX);
        x = is_finite ? x * near : 0.0, y = is_finite ? y * near : 0.0, z = is_finite ? z * near : 0.0;
        if (turn) {
            to_unit(&x, &y, &z);
            const double a = (x * turn[0] + y * turn[3]) + z * turn[6], b = (x * turn[1] + y * turn[4]) + z * turn[7];
            z = (x * turn[2] + y * turn[5]) + z * turn[8];
            x = a, y = b;
        }
        to_unit(&x, &y, &z);
        out[0][i] = x, out[1][i] = y, out[2][i] = z;
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
    for (int64_t i = first; i < end; i += TL_DIRECTIONS) {
        double v[3][TL_DIRECTIONS];
        const int n = (int)(end - i < TL_DIRECTIONS ? end - i : TL_DIRECTIONS);
        if (turn)
            unit_block(vectors, turn, i, n, v);
        else
            unit_block(vectors, NULL, i, n, v);
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
