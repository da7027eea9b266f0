/* Clusters: sorts a mesh in object space into sets of neighbouring triangles, and bounds each set; a view draws only
 * some.
 * In: vertices and triangles.  Out: clusters, their vertices, and the boxes and normals that cluster_view.c tests.
 *
 * Based on: G. M. Morton, A Computer Oriented Geodetic Data Base, 1966 (the order); S. Kumar, D. Manocha, B. Garrett,
 * M. Lin, Hierarchical Back-Face Computation, 1996 (cones of normals). */
#ifndef TL_CLUSTER_SORT_C
#define TL_CLUSTER_SORT_C

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "clusters/clusters.h"

#define TL_CURVE_BITS 10 /* cells a side: 1024; a surface meets some millions of them */

static inline void object_position(const tl_source *source, int64_t i, double *p)
{
    for (int k = 0; k < 3; k++)
        p[k] = source->scalar == TL_F32 ? (double)((const float *)source->data)[3 * i + k]
                                        : ((const double *)source->data)[3 * i + k];
}

/* A number below 2^10 with two zeros between its bits. */
static inline uint32_t spread_bits(uint32_t a)
{
    a = (a | a << 16) & 0x030000ffu;
    a = (a | a << 8) & 0x0300f00fu;
    a = (a | a << 4) & 0x030c30c3u;
    return (a | a << 2) & 0x09249249u;
}

static void place_on_curve(const tl_source *source, const int32_t *triangles, int64_t first, int64_t end,
                           const double *box, uint32_t *keys)
{
    const double side = fmax(fmax(box[3] - box[0], box[4] - box[1]), box[5] - box[2]);
    const double last = (double)((1 << TL_CURVE_BITS) - 1), scale = side > 0.0 ? (last + 1.0) / 3.0 / side : 0.0;
    for (int64_t i = first; i < end; i++) {
        double p[3][3];
        uint32_t key = 0;
        for (int k = 0; k < 3; k++)
            object_position(source, triangles[3 * i + k], p[k]);
        for (int k = 0; k < 3; k++) {
            const double cell = ((p[0][k] - box[k]) + (p[1][k] - box[k]) + (p[2][k] - box[k])) * scale;
            key |= spread_bits(cell > 0.0 ? (uint32_t)(cell < last ? cell : last) : 0) << k; /* NaN: 0 */
        }
        keys[i] = key;
    }
}

/* Radix sort by 10 bits at a time, the lowest first. */
static void sort_keys(const uint32_t *keys, int64_t n, uint64_t *room, uint64_t *other_room, int32_t *order)
{
    enum { DIGIT = TL_CURVE_BITS, N_DIGITS = 3, N_VALUES = 1 << DIGIT };
    int64_t starts[N_DIGITS][N_VALUES];
    memset(starts, 0, sizeof starts);
    for (int64_t i = 0; i < n; i++) {
        room[i] = (uint64_t)keys[i] << 32 | (uint64_t)i;
        for (int d = 0; d < N_DIGITS; d++)
            starts[d][keys[i] >> d * DIGIT & (N_VALUES - 1)]++;
    }
    for (int d = 0; d < N_DIGITS; d++) {
        int64_t sum = 0;
        for (int k = 0; k < N_VALUES; k++) {
            const int64_t count = starts[d][k];
            starts[d][k] = sum;
            sum += count;
        }
        for (int64_t i = 0; i < n; i++)
            other_room[starts[d][room[i] >> (32 + d * DIGIT) & (N_VALUES - 1)]++] = room[i];
        uint64_t *sorted = other_room;
        other_room = room, room = sorted;
    }
    for (int64_t i = 0; i < n; i++)
        order[i] = (int32_t)room[i];
}

static int64_t cut_clusters(const int32_t *triangles, const int32_t *order, int64_t n, int32_t *seen,
                            tl_cluster *clusters, int32_t *vertices, uint8_t *corners, int64_t *n_used)
{
    int64_t n_clusters = 0, n_vertices = 0;
    tl_cluster *c = NULL;
    for (int64_t i = 0; i < n; i++) {
        const int32_t *t = triangles + 3 * (int64_t)order[i];
        int n_new = 0;
        for (int k = 0; c && k < 3; k++)
            n_new += seen[t[k]] < c->first_vertex; /* not yet in this cluster */
        if (!c || c->n_triangles == TL_CLUSTER || c->n_vertices + n_new > TL_CLUSTER) {
            c = clusters + n_clusters++;
            *c = (tl_cluster){.cone_cos = -1.0, .first_triangle = i, .first_vertex = n_vertices};
        }
        for (int k = 0; k < 3; k++) {
            if (seen[t[k]] < c->first_vertex) {
                vertices[n_vertices] = t[k];
                seen[t[k]] = (int32_t)n_vertices++;
                c->n_vertices++;
            }
            corners[3 * i + k] = (uint8_t)(seen[t[k]] - c->first_vertex);
        }
        c->n_triangles++;
    }
    *n_used = n_vertices;
    return n_clusters;
}

static inline double dot_3(const double *a, const double *b) { return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]; }

static inline void cross_3(const double *a, const double *b, double *out)
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Sets a triangle's normal, of length twice its area, and its longest side; returns 0 when two corners coincide: such a
 * triangle has no area after any snap. */
static int triangle_normal(const double (*points)[3], const uint8_t *corners, double *normal, double *longest)
{
    double side[3][3];
    *longest = 0.0;
    for (int k = 0; k < 3; k++) {
        const double *a = points[corners[k]], *b = points[corners[k == 2 ? 0 : k + 1]];
        for (int j = 0; j < 3; j++)
            side[k][j] = b[j] - a[j];
        const double length = sqrt(dot_3(side[k], side[k]));
        if (length == 0.0)
            return 0;
        *longest = fmax(*longest, length);
    }
    cross_3(side[0], side[1], normal);
    return 1;
}

/* Sets the cone of the normals: its axis, and the cosine of its half angle; <= 0 when it is too wide to be of use. */
static void measure_cone(const double (*points)[3], const uint8_t *corners, tl_cluster *c)
{
    double axis[3] = {0.0, 0.0, 0.0}, normal[3], longest;
    c->min_area = c->min_height = INFINITY;
    c->cone_cos = 1.0;
    for (int i = 0; i < c->n_triangles; i++) {
        if (!triangle_normal(points, corners + 3 * i, normal, &longest))
            continue;
        const double area = sqrt(dot_3(normal, normal));
        c->min_area = fmin(c->min_area, area);
        c->min_height = fmin(c->min_height, area / longest);
        for (int k = 0; k < 3 && area > 0.0; k++)
            axis[k] += normal[k] / area;
    }
    const double length = sqrt(dot_3(axis, axis));
    if (!(length > 0.0 && c->min_area > 0.0)) {
        c->cone_cos = -1.0;
        return;
    }
    for (int k = 0; k < 3; k++)
        c->axis[k] = axis[k] / length;
    for (int i = 0; i < c->n_triangles; i++)
        if (triangle_normal(points, corners + 3 * i, normal, &longest))
            c->cone_cos = fmin(c->cone_cos, dot_3(normal, c->axis) / sqrt(dot_3(normal, normal)));
    c->cone_cos -= 0x1p-40; /* rounding */
}

static void widen_box(double *low, double *high, const double *p)
{
    for (int k = 0; k < 3; k++) {
        low[k] = p[k] < low[k] ? p[k] : low[k];
        high[k] = p[k] > high[k] ? p[k] : high[k];
    }
}

static void measure_clusters(const tl_source *source, const uint8_t *corners, int64_t first, int64_t end,
                             tl_cluster *clusters, double *group_boxes)
{
    double points[TL_CLUSTER][3];
    for (int64_t i = first; i < end; i++) {
        tl_cluster *c = clusters + i;
        double *box = group_boxes + 6 * (i / TL_CLUSTER_GROUP);
        int is_finite = 1;
        for (int k = 0; k < 3; k++) {
            c->low[k] = INFINITY, c->high[k] = -INFINITY;
            if (i % TL_CLUSTER_GROUP == 0)
                box[k] = INFINITY, box[3 + k] = -INFINITY;
        }
        for (int j = 0; j < c->n_vertices; j++) {
            object_position(source, c->first_vertex + j, points[j]);
            for (int k = 0; k < 3; k++)
                is_finite &= fabs(points[j][k]) <= FLT_MAX;
            widen_box(c->low, c->high, points[j]);
        }
        if (is_finite)
            measure_cone(points, corners + 3 * c->first_triangle, c);
        else /* NaN fails every comparison: the cluster is always drawn */
            c->low[0] = c->high[0] = TL_NAN;
        if (is_finite && box[0] == box[0]) {
            widen_box(box, box + 3, c->low);
            widen_box(box, box + 3, c->high);
        } else {
            box[0] = TL_NAN;
        }
    }
}

#endif
