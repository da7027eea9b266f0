/* Directions to points of the faces of a cube map, and backwards.
 *
 * The faces are those of the OpenGL 4.6 specification, table 8.19: +x, -x, +y, -y, +z, -z.  Beyond an edge of a face,
 * where its plane runs on as seen from the middle, lies the next one. */
#ifndef TL_GRAD_CUBE_C
#define TL_GRAD_CUBE_C

#include <math.h>
#include <stdint.h>

#include "lanes/inline.h"

/* The axes of each face: of u (its columns), of v (its rows), and from the middle to the face. */
static const int8_t cube_frames[6][3][3] = {
    {{0, 0, -1}, {0, -1, 0}, {1, 0, 0}}, {{0, 0, 1}, {0, -1, 0}, {-1, 0, 0}}, {{1, 0, 0}, {0, 0, 1}, {0, 1, 0}},
    {{1, 0, 0}, {0, 0, -1}, {0, -1, 0}}, {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}},  {{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}},
};

/* Where a direction meets the cube. */
typedef struct {
    int face; /* -1: nowhere */
    double along[3], uv[2], slopes[4], by[3][2];
} cube_point;

/* `by`: what the direction changes by along x and along y, (3, 2), or NULL. */
TL_INLINE cube_point meet_cube(const double *direction, const double *by)
{
    cube_point p = {.face = -1};
    const double x = fabs(direction[0]), y = fabs(direction[1]), z = fabs(direction[2]);
    const int axis = z > (x > y ? x : y) ? 2 : y > x ? 1 : 0;
    const int face = 2 * axis + (direction[axis] < 0.0);
    if (!(isfinite(x) && isfinite(y) && isfinite(z)) || direction[axis] == 0.0)
        return p;
    p.face = face;
    for (int j = 0; j < 3; j++)
        for (int k = 0; k < 3; k++) {
            p.along[j] += cube_frames[face][j][k] * direction[k];
            for (int c = 0; by && c < 2; c++)
                p.by[j][c] += cube_frames[face][j][k] * by[2 * k + c];
        }
    for (int j = 0; j < 2; j++) {
        const double at = p.along[j] / p.along[2], uv = at / 2.0 + 0.5;
        p.uv[j] = uv < 0.0 ? 0.0 : uv > 1.0 ? 1.0 : uv;
        for (int c = 0; by && c < 2; c++)
            p.slopes[2 * j + c] = (p.by[j][c] - at * p.by[2][c]) / p.along[2] / 2.0;
    }
    return p;
}

/* Gradients of the direction (3), and of what it changes by (3, 2), or NULL, from those of u, v and the slopes. */
TL_INLINE void pull_cube(const cube_point *p, const double *g_uv, const double *g_slopes, double *g_direction,
                         double *g_by)
{
    double along[3] = {0}, by[3][2] = {{0}};
    const double d = p->along[2];
    for (int j = 0; j < 2; j++) {
        const double at = p->along[j] / d, uv = at / 2.0 + 0.5;
        double g_at = uv >= 0.0 && uv <= 1.0 ? g_uv[j] / 2.0 : 0.0;
        for (int c = 0; g_by && c < 2; c++) {
            const double g = g_slopes[2 * j + c] / d / 2.0;
            by[j][c] += g, by[2][c] -= g * at;
            g_at -= g * p->by[2][c];
            along[2] -= g_slopes[2 * j + c] * p->slopes[2 * j + c] / d;
        }
        along[j] += g_at / d;
        along[2] -= g_at * at / d;
    }
    for (int k = 0; k < 3; k++) {
        g_direction[k] = 0.0;
        for (int c = 0; g_by && c < 2; c++)
            g_by[2 * k + c] = 0.0;
        for (int j = 0; j < 3; j++) {
            g_direction[k] += cube_frames[p->face][j][k] * along[j];
            for (int c = 0; g_by && c < 2; c++)
                g_by[2 * k + c] += cube_frames[p->face][j][k] * by[j][c];
        }
    }
}

/* Moves a texel that lies beyond one edge of its face to the face that is there. */
static void cross_edge(int64_t n, int *face, int64_t *x, int64_t *y)
{
    const double middle[3] = {2.0 * ((double)*x + 0.5) / (double)n - 1.0, 2.0 * ((double)*y + 0.5) / (double)n - 1.0,
                              1.0};
    double direction[3] = {0};
    for (int k = 0; k < 3; k++)
        for (int j = 0; j < 3; j++)
            direction[k] += middle[j] * cube_frames[*face][j][k];
    const cube_point p = meet_cube(direction, 0);
    *face = p.face;
    *x = (int64_t)(p.uv[0] * (double)n), *y = (int64_t)(p.uv[1] * (double)n);
    *x = *x > n - 1 ? n - 1 : *x, *y = *y > n - 1 ? n - 1 : *y;
}

#endif
