/* Normals of triangles and of vertices, which side these point to, and the box of a mesh; and rows of three numbers as
 * unit vectors, rotated, transformed, and as the rows of four that shading reads.
 * In: vertices, triangles, vectors or colours of a mesh.  Out: unit vectors, flags, a box; rows of float64 (n, 3), or
 * of float32 (n, 4) with 1 as the fourth number.
 *
 * Triangles are processed by blocks: corners are gathered one by one, normals are computed a vector of triangles at a
 * time, and sums are scattered one by one.  Angles use angle.h, because arctangents of C libraries differ.  All else is
 * sums, products, quotients and roots, each rounded once, in the written order: every machine gives equal bits.  An
 * angle is within 2^-48 radians where sides are exact.
 *
 * Based on: G. Thurmer and C. A. Wuthrich, Computing Vertex Normals from Polygonal Facets, Journal of Graphics Tools
 * 3(1), 1998; W. Kahan, Miscalculating Area and Angles of a Needle-like Triangle, 2014. */
#ifndef TL_NORMALS_C
#define TL_NORMALS_C

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/angle.h"
#include "lanes/lanes.h"

/* Powers of two, 2^-1 to 2^1022, that scale numbers up to 2^1022 to [1/2, 1): products with them are exact down to
 * 2^-1074; and their inverses. */
TL_INLINE vd power_to_one(vd a) { return vd_power(a, 2045ull << 52, 2047ull << 52); }
TL_INLINE vd power_from_one(vd power) { return vd_power(power, 2046ull << 52, 2047ull << 52); }

TL_INLINE vd largest_of(const vd *v) { return vd_max(vd_max(vd_abs(v[0]), vd_abs(v[1])), vd_abs(v[2])); }

TL_INLINE vd dot_of(const vd *a, const vd *b)
{
    return vd_add(vd_add(vd_mul(a[0], b[0]), vd_mul(a[1], b[1])), vd_mul(a[2], b[2]));
}

/* Scales vectors, of numbers below 2^1022, to length 1, whatever their length; zero stays zero.  Returns their
 * lengths. */
TL_INLINE vd to_unit(vd *v)
{
    const vd power = power_to_one(largest_of(v));
    for (int k = 0; k < 3; k++)
        v[k] = vd_mul(v[k], power);
    const vd length = vd_sqrt(dot_of(v, v));
    const vm is_any = vd_ge(length, vd_set1(0x1p-60)); /* the largest number is then 2^-52 or more */
    const vd divisor = vd_select(is_any, length, vd_set1(1.0));
    for (int k = 0; k < 3; k++)
        v[k] = vd_select(is_any, vd_div(v[k], divisor), vd_set1(0.0));
    return vd_mul(length, power_from_one(power));
}

static inline void load_three(const tl_source *source, int64_t i, double *p)
{
    for (int k = 0; k < 3; k++)
        p[k] = source->scalar == TL_F32 ? (double)((const float *)source->data)[3 * i + k]
                                        : ((const double *)source->data)[3 * i + k];
}

#define TL_DIRECTIONS 64 /* at a time, whole vectors of lanes */

/* Loads vectors, scaled down if their squares would overflow; vectors that are not finite become zero. */
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

static void unit_vectors(const tl_source *vectors, const double *turn, int64_t first, int64_t end, double *out,
                         float *rows)
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
        row[0] = (float)color[0], row[1] = (float)color[1], row[2] = (float)color[2];
        row[3] = n_channels == 4 ? (float)color[3] / 255.0f : 1.0f;
    }
}

#define TL_FACES 64 /* at a time, whole vectors of lanes: a block stays in the first-level cache */

typedef struct {
    int n;
    int64_t id[TL_FACES];
    double corner[3][3][TL_FACES]; /* by corner and axis */
    double normal[3][TL_FACES];    /* unit, counter-clockwise; 0 without an area */
    double angle[3][TL_FACES];     /* by corner */
} face_block;

/* The first of triangles [first, end) with an index outside the vertices, or -1. */
static int64_t bad_face(const int32_t *triangles, int64_t first, int64_t end, int64_t n_vertices)
{
    const uint32_t limit = (uint32_t)(n_vertices < INT32_MAX ? n_vertices : INT32_MAX);
    uint32_t n_bad = 0;
    for (int64_t i = 3 * first; i < 3 * end; i++)
        n_bad += (uint32_t)triangles[i] >= limit;
    for (int64_t i = 3 * first; n_bad && i < 3 * end; i++)
        if ((uint32_t)triangles[i] >= limit)
            return i / 3;
    return -1;
}

/* Loads the corners of a block.  Differences of numbers beyond 2^1000 might overflow: such a face is scaled down,
 * exactly. */
TL_INLINE void gather_as(const void *data, int is_f32, const int32_t *triangles, face_block *b)
{
    for (int i = 0; i < b->n; i++) {
        const int32_t *t = triangles + 3 * b->id[i];
        double far = 0.0;
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++) {
                const int64_t at = 3 * (int64_t)t[c] + k;
                const double p = is_f32 ? (double)((const float *)data)[at] : ((const double *)data)[at];
                b->corner[c][k][i] = p;
                far = is_f32 ? 0.0 : far + fabs(p);
            }
        for (int k = 0; far > 0x1p1000 && k < 9; k++)
            b->corner[k / 3][k % 3][i] *= 0x1p-60;
    }
}

static void gather_corners(const tl_source *source, const int32_t *triangles, face_block *b)
{
    if (source->scalar == TL_F32)
        gather_as(source->data, 1, triangles, b);
    else
        gather_as(source->data, 0, triangles, b);
}

/* Selects from three values the value at the corner with the largest angle. */
typedef struct {
    vm is_first, is_not_last; /* corner 0 rather than 1; 0 or 1 rather than 2 */
} widest_corner;

TL_INLINE vd pick_widest(widest_corner w, vd at_0, vd at_1, vd at_2)
{
    return vd_select(w.is_not_last, vd_select(w.is_first, at_0, at_1), at_2);
}

/* Sets normals and, if wanted, angles.  Both start at the corner with the largest angle, between the two shortest
 * sides: their product loses least for needles.  Swapping corners changes only the sign of the normal. */
TL_INLINE void measure_block(face_block *b, int with_angles)
{
    for (int i = 0; i < b->n; i += TL_LANES) {
        vd s[3][3], dot[3], u[3], v[3], normal[3];
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                s[c][k] = vd_sub(vd_load(b->corner[c == 2 ? 0 : c + 1][k] + i), vd_load(b->corner[c][k] + i));
        const vd power = power_to_one(vd_max(vd_max(largest_of(s[0]), largest_of(s[1])), largest_of(s[2])));
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                s[c][k] = vd_mul(s[c][k], power);
        for (int c = 0; c < 3; c++)
            dot[c] = vd_sub(vd_set1(0.0), dot_of(s[c], s[c == 0 ? 2 : c - 1]));
        const vm is_first = vd_ge(dot[1], dot[0]);
        const widest_corner widest = {is_first, vd_ge(dot[2], vd_select(is_first, dot[0], dot[1]))};
        for (int k = 0; k < 3; k++) {
            u[k] = pick_widest(widest, s[2][k], s[0][k], s[1][k]);
            v[k] = pick_widest(widest, s[0][k], s[1][k], s[2][k]);
        }
        for (int k = 0; k < 3; k++) {
            const int j = k == 2 ? 0 : k + 1, l = k == 0 ? 2 : k - 1;
            normal[k] = vd_sub(vd_mul(u[j], v[l]), vd_mul(u[l], v[j]));
        }
        const vd area = to_unit(normal);
        for (int k = 0; k < 3; k++)
            vd_store(b->normal[k] + i, normal[k]);
        if (with_angles) {
            const vd onward = angle_of(area, pick_widest(widest, dot[1], dot[2], dot[0]));
            const vd back = angle_of(area, pick_widest(widest, dot[2], dot[0], dot[1]));
            const vd largest = vd_sub(vd_set1(0x1.921fb54442d18p+1), vd_add(onward, back));
            vd_store(b->angle[0] + i, pick_widest(widest, largest, back, onward));
            vd_store(b->angle[1] + i, pick_widest(widest, onward, largest, back));
            vd_store(b->angle[2] + i, pick_widest(widest, back, onward, largest));
        }
    }
}

/* Loads a block of consecutive triangles.  Returns -1, or a row with an index outside the vertices. */
static int64_t load_block(const tl_source *source, const int32_t *triangles, int64_t first, int64_t end, face_block *b)
{
    b->n = (int)(end - first < TL_FACES ? end - first : TL_FACES);
    const int64_t bad = bad_face(triangles, first, first + b->n, source->n);
    if (bad >= 0)
        return bad;
    for (int i = 0; i < b->n; i++)
        b->id[i] = first + i;
    gather_corners(source, triangles, b);
    return -1;
}

/* Adds the block's faces to the sums of the vertices [first, end). */
static void add_block(face_block *b, const tl_source *source, const int32_t *triangles, int64_t first, int64_t end,
                      double *sums)
{
    gather_corners(source, triangles, b);
    measure_block(b, 1);
    for (int i = 0; i < b->n; i++) {
        const int32_t *t = triangles + 3 * b->id[i];
        const double x = b->normal[0][i], y = b->normal[1][i], z = b->normal[2][i];
        for (int c = 0; c < 3; c++) {
            if (t[c] < first || t[c] >= end)
                continue;
            double *sum = sums + 3 * (int64_t)t[c];
            sum[0] += b->angle[c][i] * x, sum[1] += b->angle[c][i] * y, sum[2] += b->angle[c][i] * z;
        }
    }
    b->n = 0;
}

/* Reads all triangles, and computes those that have one of the vertices: so no range of vertices needs sums of another,
 * and each sum has the order of the faces. */
static int64_t vertex_normals(const tl_source *source, const int32_t *triangles, int64_t n_triangles, int64_t first,
                              int64_t end, double *out)
{
    const uint32_t low = (uint32_t)first, n = (uint32_t)(end - first);
    face_block b = {.n = 0};
    memset(out + 3 * first, 0, (size_t)(end - first) * 3 * sizeof *out);
    for (int64_t i = 0; i < n_triangles; i += TL_FACES) {
        const int64_t last = i + TL_FACES < n_triangles ? i + TL_FACES : n_triangles;
        const int64_t bad = bad_face(triangles, i, last, source->n);
        if (bad >= 0)
            return bad;
        for (int64_t face = i; face < last; face++) {
            const int32_t *t = triangles + 3 * face;
            b.id[b.n] = face;
            b.n += ((uint32_t)t[0] - low < n) | ((uint32_t)t[1] - low < n) | ((uint32_t)t[2] - low < n);
            if (b.n == TL_FACES)
                add_block(&b, source, triangles, first, end, out);
        }
    }
    add_block(&b, source, triangles, first, end, out);
    const tl_source sums = {.data = out, .scalar = TL_F64, .n_components = 3, .n = source->n};
    unit_vectors(&sums, NULL, first, end, out, NULL);
    return -1;
}

static int64_t face_normals(const tl_source *source, const int32_t *triangles, int64_t first, int64_t end, double *out,
                            float *rows)
{
    face_block b = {.n = 0};
    _Static_assert(TL_FACES == TL_DIRECTIONS, "a block of faces has a block of normals");
    for (int64_t i = first; i < end; i += b.n) {
        const int64_t bad = load_block(source, triangles, i, end, &b);
        if (bad >= 0)
            return bad;
        measure_block(&b, 0);
        store_rows(b.normal, b.n, i, out, rows);
    }
    return -1;
}

static int64_t find_turned(const tl_source *source, const int32_t *triangles, int64_t first, int64_t end,
                           const float *normals, const int32_t *row_of_corner, uint8_t *is_turned)
{
    face_block b = {.n = 0};
    for (int64_t i = first; i < end; i += b.n) {
        double sum[3][TL_FACES];
        const int64_t bad = load_block(source, triangles, i, end, &b);
        if (bad >= 0)
            return bad;
        measure_block(&b, 0);
        for (int j = 0; j < b.n; j++) {
            const int32_t *t = row_of_corner + 3 * (i + j);
            for (int k = 0; k < 3; k++)
                sum[k][j] = ((double)normals[4 * (int64_t)t[0] + k] + (double)normals[4 * (int64_t)t[1] + k]) +
                            (double)normals[4 * (int64_t)t[2] + k];
        }
        for (int j = 0; j < b.n; j++)
            is_turned[i + j] =
                (sum[0][j] * b.normal[0][j] + sum[1][j] * b.normal[1][j]) + sum[2][j] * b.normal[2][j] < 0.0;
    }
    return -1;
}

/* low x, y, z, high x, y, z. */
static int64_t box_of_faces(const tl_source *source, const int32_t *triangles, int64_t first, int64_t end, double *box)
{
    for (int k = 0; k < 3; k++)
        box[k] = INFINITY, box[3 + k] = -INFINITY;
    for (int64_t i = first; i < end; i += TL_FACES) {
        const int64_t last = i + TL_FACES < end ? i + TL_FACES : end, bad = bad_face(triangles, i, last, source->n);
        if (bad >= 0)
            return bad;
        for (int64_t j = 3 * i; j < 3 * last; j++) {
            double p[3];
            load_three(source, triangles[j], p);
            for (int k = 0; k < 3; k++) {
                box[k] = p[k] < box[k] ? p[k] : box[k];
                box[3 + k] = p[k] > box[3 + k] ? p[k] : box[3 + k];
            }
        }
    }
    return -1;
}

#endif
