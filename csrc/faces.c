/* Faces: the normals of triangles and of vertices, which side these are on, and the box round a mesh.
 * In: vertices and triangles.  Out: unit vectors, flags, a box.
 *
 * Triangles go by blocks: corners are gathered one by one, then a plain loop without branches, which compilers turn into vectors,
 * computes all that follows, then sums are scattered one by one.  Angles have an arctangent of their own, as those of C libraries
 * differ; so every machine has the same bits.
 *
 * Based on: G. Thurmer and C. A. Wuthrich, Computing Vertex Normals from Polygonal Facets, Journal of Graphics Tools 3(1), 1998;
 * W. Kahan, Miscalculating Area and Angles of a Needle-like Triangle, 2014 (shortest sides first). */
#include "fixed.h"
#include "lanes.h" /* TL_INLINE */

#define TL_FACES 64 /* at a time: 192 corners, some KiB */

typedef struct {
    int n;
    int64_t id[TL_FACES];
    double corner[3][3][TL_FACES]; /* by corner and axis */
    double normal[3][TL_FACES];    /* unit, counter-clockwise; 0 without an area */
    double angle[3][TL_FACES];     /* by corner */
} face_block;

/* The first of some triangles with an index outside the vertices, -1 if there is none. */
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

/* Differences of what is beyond 2^1000 might overflow: such a face is made smaller, exactly. */
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
                far = is_f32 ? 0.0 : larger(far, fabs(p));
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

/* The angle whose tangent is y / x, of y >= 0 and an x that is positive but for rounding; 0 of 0 and 0.  The quotient is turned back by
 * 0, 45 or 90 degrees to within tan(22.5 degrees) of 0, where the polynomial is within 2^-56 of atan(q) / q. */
TL_INLINE double angle_of(double y, double x)
{
    const int is_low = x * 0x1.a827999fcef32p-2 > y, is_high = y * 0x1.a827999fcef32p-2 > x;
    const double above = is_low ? y : is_high ? -x : y - x, below = is_low ? x : is_high ? y : y + x;
    const double start = is_low ? 0.0 : is_high ? 0x1.921fb54442d18p+0 : 0x1.921fb54442d18p-1;
    const double q = above / (below > 0.0 ? below : 1.0), z = q * q;
    double sum = -0x1.3a2f1cc1ba3c5p-6;
    sum = sum * z + 0x1.4161b24be475bp-5;
    sum = sum * z + -0x1.a0993ef875d4ap-5;
    sum = sum * z + 0x1.dfe637a48099bp-5;
    sum = sum * z + -0x1.10fa76aa9b02cp-4;
    sum = sum * z + 0x1.3b1262f3a2b5bp-4;
    sum = sum * z + -0x1.745d0b27da190p-4;
    sum = sum * z + 0x1.c71c7185386f1p-4;
    sum = sum * z + -0x1.2492492436180p-3;
    sum = sum * z + 0x1.999999999934bp-3;
    sum = sum * z + -0x1.5555555555555p-2;
    const double angle = start + (q + q * (z * sum));
    return below > 0.0 ? angle : 0.0;
}

/* Normals and, where wanted, angles.  Both begin at the corner with the largest angle, between the two shortest sides: their product
 * loses least for needles.  With the corners the other way round, the normal changes its sign and nothing else. */
TL_INLINE void measure_block(face_block *b, int with_angles)
{
    for (int i = 0; i < b->n; i++) {
        double s[3][3];
        for (int k = 0; k < 3; k++) {
            s[0][k] = b->corner[1][k][i] - b->corner[0][k][i];
            s[1][k] = b->corner[2][k][i] - b->corner[1][k][i];
            s[2][k] = b->corner[0][k][i] - b->corner[2][k][i];
        }
        const double far = larger(larger(largest_of(s[0][0], s[0][1], s[0][2]), largest_of(s[1][0], s[1][1], s[1][2])),
                                  largest_of(s[2][0], s[2][1], s[2][2]));
        const double power = power_to_one(far);
        for (int k = 0; k < 3; k++)
            s[0][k] *= power, s[1][k] *= power, s[2][k] *= power;
        const double d0 = -((s[2][0] * s[0][0] + s[2][1] * s[0][1]) + s[2][2] * s[0][2]);
        const double d1 = -((s[0][0] * s[1][0] + s[0][1] * s[1][1]) + s[0][2] * s[1][2]);
        const double d2 = -((s[1][0] * s[2][0] + s[1][1] * s[2][1]) + s[1][2] * s[2][2]);
        const int at_1 = (d1 < d0) & (d1 <= d2), at_2 = (d2 < d0) & (d2 < d1);
        double u[3], v[3];
        for (int k = 0; k < 3; k++) {
            u[k] = at_1 ? s[0][k] : at_2 ? s[1][k] : s[2][k];
            v[k] = at_1 ? s[1][k] : at_2 ? s[2][k] : s[0][k];
        }
        double x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2], z = u[0] * v[1] - u[1] * v[0];
        const double area = to_unit(&x, &y, &z);
        b->normal[0][i] = x, b->normal[1][i] = y, b->normal[2][i] = z;
        if (with_angles) {
            const double onward = angle_of(area, at_1 ? d2 : at_2 ? d0 : d1), back = angle_of(area, at_1 ? d0 : at_2 ? d1 : d2);
            const double largest = 0x1.921fb54442d18p+1 - (onward + back);
            b->angle[0][i] = at_1 ? back : at_2 ? onward : largest;
            b->angle[1][i] = at_1 ? largest : at_2 ? back : onward;
            b->angle[2][i] = at_1 ? onward : at_2 ? largest : back;
        }
    }
}

/* A block of neighbours.  Returns -1, or a row with an index outside the vertices. */
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
static void add_block(face_block *b, const tl_source *source, const int32_t *triangles, int64_t first, int64_t end, double *sums)
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

/* Goes through all triangles, and computes those that have one of the vertices: a range of vertices needs no other's sums, and each sum
 * has the order of the faces. */
static int64_t vertex_normals(const tl_source *source, const int32_t *triangles, int64_t n_triangles, int64_t first, int64_t end,
                              double *out)
{
    const uint32_t low = (uint32_t)first, n = (uint32_t)(end - first);
    face_block b = {.n = 0};
    memset(out + 3 * first, 0, (size_t)(end - first) * 3 * sizeof *out);
    for (int64_t i = 0; i < n_triangles; i += TL_FACES) {
        const int64_t last = i + TL_FACES < n_triangles ? i + TL_FACES : n_triangles, bad = bad_face(triangles, i, last, source->n);
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

static int64_t face_normals(const tl_source *source, const int32_t *triangles, int64_t first, int64_t end, double *out, float *rows)
{
    face_block b;
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

static int64_t find_turned(const tl_source *source, const int32_t *triangles, int64_t first, int64_t end, const float *normals,
                           uint8_t *is_turned)
{
    face_block b;
    for (int64_t i = first; i < end; i += b.n) {
        double sum[3][TL_FACES];
        const int64_t bad = load_block(source, triangles, i, end, &b);
        if (bad >= 0)
            return bad;
        measure_block(&b, 0);
        for (int j = 0; j < b.n; j++) {
            const int32_t *t = triangles + 3 * (i + j);
            for (int k = 0; k < 3; k++)
                sum[k][j] = ((double)normals[4 * (int64_t)t[0] + k] + (double)normals[4 * (int64_t)t[1] + k]) + (double)normals[4 * (int64_t)t[2] + k];
        }
        for (int j = 0; j < b.n; j++)
            is_turned[i + j] = (sum[0][j] * b.normal[0][j] + sum[1][j] * b.normal[1][j]) + sum[2][j] * b.normal[2][j] < 0.0;
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
