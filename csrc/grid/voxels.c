/* Voxels: inside voxels from columns of crossings, and the voxels that triangles meet.
 * In: bits that TL_SINK_PEEL has set of a mesh drawn along its columns, or points in voxels.  Out: a byte or a share of
 * each voxel, the steps of a column side by side.
 *
 * Based on: M. Schwarz, H.-P. Seidel, Fast Parallel Surface and Solid Voxelization on GPUs, 2010 (parity by flipped
 * bits; a triangle meets a cube if their projections meet and the cube meets the plane). */
#ifndef TL_VOXELS_C
#define TL_VOXELS_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "polygons/row_bits.c"
#include "vertex/corners.h"

/* Whether the winding numbers along a column leave 0 and 1 (bit 0), and 0 and -1 (bit 1). */
static int nesting_of(const uint64_t *bits, const uint64_t *twos, int64_t n_words)
{
    int winding = 0, found = 0;
    for (int64_t k = 0; k < n_words; k++)
        for (uint64_t rest = bits[k] | twos[k]; rest; rest &= rest - 1) {
            const uint64_t bit = rest & -rest;
            if (!(bits[k] & bit)) /* two fronts or two backs in one step */
                return 3;
            winding += twos[k] & bit ? -1 : 1;
            found |= (winding < 0 || winding > 1) | (winding < -1 || winding > 0) << 1;
        }
    return found;
}

/* A column with an odd number of crossings loses its last crossing. */
static int64_t fill_columns(uint64_t *bits, const uint64_t *twos, int64_t n_columns, int64_t n_words, int64_t *n_nested)
{
    int64_t n_odd = 0;
    for (int64_t i = 0; i < n_columns; i++, bits += n_words, twos += n_words) {
        const int nesting = nesting_of(bits, twos, n_words);
        n_nested[0] += nesting & 1, n_nested[1] += nesting >> 1;
        uint64_t parity = 0, any = 0;
        for (int64_t k = 0; k < n_words; k++)
            parity ^= bits[k], any |= bits[k];
        if (!any)
            continue;
        if (__builtin_parityll(parity)) {
            int64_t last = n_words - 1;
            while (!bits[last])
                last--;
            bits[last] &= ~(1ull << (63 - __builtin_clzll(bits[last])));
            n_odd++;
        }
        fill_parity(bits, n_words);
    }
    return n_odd;
}

static void expand_columns(const uint64_t *bits, int64_t n_columns, int64_t n_words, int64_t n_steps, uint8_t *out)
{
    for (int64_t i = 0; i < n_columns; i++, bits += n_words, out += n_steps) {
        int64_t k = 0;
        for (; k + 64 <= n_steps; k += 64)
            bytes_from_bits(out + k, bits[k >> 6]);
        if (k < n_steps) {
            uint8_t tail[64];
            bytes_from_bits(tail, bits[k >> 6]);
            memcpy(out + k, tail, (size_t)(n_steps - k));
        }
    }
}

/* A voxel has 2^sample_bits samples along each axis. */
static void count_columns(const uint64_t *bits, int64_t n_columns, int64_t n_words, int64_t n_steps, int sample_bits,
                          float *out)
{
    const int n = 1 << sample_bits;
    const uint64_t ones = (1ull << n) - 1;
    const float share = 1.0f / (float)(n * n * n);
    const int64_t row_words = n_columns * n * n_words;
    for (int64_t column = 0; column < n_columns; column++, out += n_steps) {
        const uint64_t *const own = bits + column * n * n_words;
        for (int64_t k = 0; k < n_steps; k++) {
            const int64_t bit = k << sample_bits;
            int n_filled = 0;
            for (int y = 0; y < n; y++)
                for (int x = 0; x < n; x++)
                    n_filled +=
                        __builtin_popcountll(own[y * row_words + x * n_words + (bit >> 6)] >> (bit & 63) & ones);
            out[k] = (float)n_filled * share;
        }
    }
}

static void scatter_columns(const uint64_t *bits, int64_t n_rows, int64_t n_columns, int64_t n_words,
                            const int64_t *strides, uint8_t *out)
{
    for (int64_t row = 0; row < n_rows; row++)
        for (int64_t column = 0; column < n_columns; column++, bits += n_words) {
            uint8_t *const own = out + row * strides[0] + column * strides[1];
            for (int64_t k = 0; k < n_words; k++)
                for (uint64_t rest = bits[k]; rest; rest &= rest - 1)
                    own[((k << 6) + __builtin_ctzll(rest)) * strides[2]] = 1;
        }
}

/* Whether a unit square from (p, q) on meets the inner side of an edge of a triangle: p a + q b + c >= 0. */
typedef struct {
    double a, b, c;
} square_test;

typedef struct {
    int axes[3];             /* axes[2]: where the normal is largest */
    int64_t low[3], high[3]; /* voxels of the box, by axis of the grid */
    double normal[3], near, far;
    square_test sides[3][3]; /* [k]: along axes[k]; p, q are axes[(k + 1) % 3], axes[(k + 2) % 3] */
} voxel_test;

static void set_sides(voxel_test *t, const double (*v)[3], double size)
{
    for (int k = 0; k < 3; k++) {
        const int p = t->axes[(k + 1) % 3], q = t->axes[(k + 2) % 3], r = t->axes[k];
        /* (p, q, r) is an even permutation of (0, 1, 2), or odd */
        const double turn = (t->normal[r] < 0.0) == ((p + 1) % 3 == q) ? -1.0 : 1.0;
        for (int i = 0; i < 3; i++) {
            const double *from = v[i], *to = v[(i + 1) % 3];
            square_test *s = &t->sides[k][i];
            s->a = -turn * (to[q] - from[q]);
            s->b = turn * (to[p] - from[p]);
            const double slack = 0x1p-46 * (fabs(s->a) + fabs(s->b)) * size;
            s->c = fmax(s->a, 0.0) + fmax(s->b, 0.0) - (s->a * from[p] + s->b * from[q]) + slack;
        }
    }
}

/* Sets the test of a triangle; returns whether its box meets the grid. */
static int set_voxel_test(voxel_test *t, const double (*v)[3], const int64_t *shape)
{
    double edges[2][3], size = 1.0;
    for (int k = 0; k < 3; k++) {
        const double low = fmin(fmin(v[0][k], v[1][k]), v[2][k]), high = fmax(fmax(v[0][k], v[1][k]), v[2][k]);
        const double n = (double)shape[k];
        if (!(low <= n && high >= 0.0))
            return 0;
        t->low[k] = low >= n ? shape[k] - 1 : low > 0.0 ? (int64_t)low : 0; /* a far side is in its last voxel */
        t->high[k] = high >= n ? shape[k] - 1 : (int64_t)high;
        edges[0][k] = v[1][k] - v[0][k], edges[1][k] = v[2][k] - v[0][k];
        size = fmax(size, fmax(fabs(low), fmax(fabs(high), n)));
    }
    for (int k = 0; k < 3; k++) {
        const int p = (k + 1) % 3, q = (k + 2) % 3;
        t->normal[k] = edges[0][p] * edges[1][q] - edges[0][q] * edges[1][p];
    }
    const double *const n = t->normal;
    int w = fabs(n[0]) > fabs(n[1]) ? 0 : 1;
    w = fabs(n[w]) > fabs(n[2]) ? w : 2;
    t->axes[0] = (w + 1) % 3, t->axes[1] = (w + 2) % 3, t->axes[2] = w;
    double least = 0.0, most = 0.0, at = 0.0, sum = 0.0;
    for (int k = 0; k < 3; k++) {
        least += fmin(n[k], 0.0), most += fmax(n[k], 0.0);
        at += n[k] * v[0][k], sum += fabs(n[k]);
    }
    const double slack = 0x1p-44 * sum * size + 0x1p-48 * size * size * size;
    t->near = most - at + slack, t->far = least - at - slack;
    set_sides(t, v, size);
    return 1;
}

TL_INLINE int meets(const square_test *sides, double p, double q)
{
    return p * sides[0].a + q * sides[0].b + sides[0].c >= 0.0 && p * sides[1].a + q * sides[1].b + sides[1].c >= 0.0 &&
           p * sides[2].a + q * sides[2].b + sides[2].c >= 0.0;
}

/* Writes 1 for the voxels that a triangle meets; strides of the grid's axes. */
static void touch_triangle(const voxel_test *t, const int64_t *strides, uint8_t *out)
{
    const int u = t->axes[0], v = t->axes[1], w = t->axes[2];
    const double nw = t->normal[w];
    for (int64_t i = t->low[u]; i <= t->high[u]; i++)
        for (int64_t j = t->low[v]; j <= t->high[v]; j++) {
            if (!meets(t->sides[2], (double)i, (double)j))
                continue;
            const double base = t->normal[u] * (double)i + t->normal[v] * (double)j;
            double first = (double)t->low[w], last = (double)t->high[w];
            if (nw != 0.0) { /* base + nw k + near >= 0 and base + nw k + far <= 0 */
                const double one = -(base + t->near) / nw, other = -(base + t->far) / nw;
                first = fmax(first, floor(fmin(one, other)) - 1.0), last = fmin(last, ceil(fmax(one, other)) + 1.0);
            }
            for (double k = first; k <= last; k += 1.0) {
                const double at = base + nw * k;
                if (at + t->near >= 0.0 && at + t->far <= 0.0 && meets(t->sides[0], (double)j, k) &&
                    meets(t->sides[1], k, (double)i))
                    out[i * strides[u] + j * strides[v] + (int64_t)k * strides[w]] = 1;
            }
        }
}

/* Voxels have sides of 1, from the origin on. */
static void touch_voxels(const double *points, int64_t n_points, const int32_t *triangles, int64_t first, int64_t end,
                         const int64_t *shape, uint8_t *out)
{
    const int64_t strides[3] = {shape[1] * shape[2], shape[2], 1};
    for (int64_t i = first; i < end; i++) {
        double v[3][3];
        voxel_test t;
        for (int k = 0; k < 3; k++)
            memcpy(v[k], points + 3 * (int64_t)corner_within(triangles[3 * i + k], n_points), sizeof v[k]);
        if (set_voxel_test(&t, (const double (*)[3])v, shape))
            touch_triangle(&t, strides, out);
    }
}

#endif
