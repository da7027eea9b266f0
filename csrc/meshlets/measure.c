/* Bounds of a meshlet: a ball that holds it, the cone of its normals, how thin its triangles are.
 * In: a meshlet.  Out: a record of bounds, which list.c looks at. */
#ifndef TL_MEASURE_C
#define TL_MEASURE_C

#include <math.h>
#include <stdint.h>

#include "clusters.h"
#include "meshlets.h"
#include "topleft.h"

/* Bounds as float32 are moved outwards by more than they are rounded. */
#define TL_OUTWARDS 1.000001
#define TL_INWARDS 0.999999
#define TL_LEAST_BOUND 1e-30 /* below it float32 would round too coarsely */

static inline void meshlet_point(const tl_meshlet *m, int i, double *p)
{
    p[0] = m->x[i], p[1] = m->y[i], p[2] = m->z[i];
}

/* The normal of a triangle, as long as twice its area, and its longest side; 0 when two corners are one point: it is
 * never drawn. */
static int meshlet_normal(const tl_meshlet *m, int i, double *normal, double *longest)
{
    double p[3][3], side[3][3];
    *longest = 0.0;
    for (int k = 0; k < 3; k++)
        meshlet_point(m, m->corners[k][i], p[k]);
    for (int k = 0; k < 3; k++) {
        double squares = 0.0;
        for (int j = 0; j < 3; j++) {
            side[k][j] = p[k == 2 ? 0 : k + 1][j] - p[k][j];
            squares += side[k][j] * side[k][j];
        }
        if (squares == 0.0)
            return 0;
        *longest = fmax(*longest, sqrt(squares));
    }
    for (int k = 0; k < 3; k++) {
        const int a = k == 2 ? 0 : k + 1, b = k == 0 ? 2 : k - 1;
        normal[k] = side[0][a] * side[1][b] - side[0][b] * side[1][a];
    }
    return 1;
}

static void measure_ball(const tl_meshlet *m, int n_vertices, float *record)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, farthest = 0.0, p[3];
    for (int i = 0; i < n_vertices; i++) {
        meshlet_point(m, i, p);
        for (int k = 0; k < 3; k++)
            low[k] = fmin(low[k], p[k]), high[k] = fmax(high[k], p[k]);
    }
    for (int k = 0; k < 3; k++)
        record[TL_BOUND_X + k] = (float)(0.5 * (low[k] + high[k]));
    for (int i = 0; i < n_vertices; i++) {
        double squares = 0.0;
        meshlet_point(m, i, p);
        for (int k = 0; k < 3; k++)
            squares += (p[k] - record[TL_BOUND_X + k]) * (p[k] - record[TL_BOUND_X + k]);
        farthest = fmax(farthest, squares);
    }
    record[TL_BOUND_RADIUS] = (float)(sqrt(farthest) * TL_OUTWARDS + 1e-37);
}

static void measure_meshlet(const tl_meshlet *m, int n_vertices, int n_triangles, float *record)
{
    double axis[3] = {0.0, 0.0, 0.0}, normals[TL_MESHLET_ROOM][3], areas[TL_MESHLET_ROOM], squares = 0.0, longest;
    double height = INFINITY, side = INFINITY, least_area = INFINITY, cosine = 1.0;
    measure_ball(m, n_vertices, record);
    for (int i = 0; i < n_triangles; i++) {
        areas[i] = -1.0;
        if (!meshlet_normal(m, i, normals[i], &longest))
            continue;
        const double *n = normals[i], area = sqrt((n[0] * n[0] + n[1] * n[1]) + n[2] * n[2]);
        areas[i] = area;
        least_area = fmin(least_area, area);
        height = fmin(height, area / longest);
        side = fmin(side, longest);
        for (int k = 0; k < 3 && area > 0.0; k++)
            axis[k] += n[k] / area;
    }
    for (int k = 0; k < 3; k++)
        squares += axis[k] * axis[k];
    if (squares > 0.0 && least_area > 0.0) {
        for (int k = 0; k < 3; k++)
            axis[k] = (float)(axis[k] / sqrt(squares));
        for (int i = 0; i < n_triangles; i++)
            if (areas[i] > 0.0) {
                const double *n = normals[i];
                cosine = fmin(cosine, ((n[0] * axis[0] + n[1] * axis[1]) + n[2] * axis[2]) / areas[i]);
            }
    } else {
        cosine = -1.0;
    }
    cosine -= 1e-6;
    if (!(cosine > 0.0 && height > TL_LEAST_BOUND && side > TL_LEAST_BOUND))
        cosine = -1.0, height = 0.0, side = 1.0;
    for (int k = 0; k < 3; k++)
        record[TL_BOUND_AXIS_X + k] = (float)axis[k];
    record[TL_BOUND_COS] = (float)cosine;
    record[TL_BOUND_SIN] = cosine > 0.0 ? (float)(sqrt(fmax(0.0, 1.0 - cosine * cosine)) + 1e-6) : 1.0f;
    record[TL_BOUND_HEIGHT] = (float)(fmin(height, 1e37) * TL_INWARDS);
    record[TL_BOUND_SIDE] = (float)(fmin(side, 1e37) * TL_INWARDS);
}

#endif
