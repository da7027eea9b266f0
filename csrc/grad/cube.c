/* Directions to points on the faces of a cube map, in lanes; and backward.
 *
 * The faces are those of the OpenGL 4.6 specification, table 8.19: +x, -x, +y, -y, +z, -z.  Points on the plane of a
 * face beyond its edge are projected from the centre of the cube onto the next face. */
#ifndef TL_GRAD_CUBE_C
#define TL_GRAD_CUBE_C

#include <float.h>
#include <stdint.h>

#include "lanes/lanes.h"

/* Faces, and the points where directions meet them. */
typedef struct {
    vi face;
    vm is_x, is_y; /* whether the face is perpendicular to that axis; neither: to z */
    vd sign;       /* 1 or -1: the side of the axis */
    vm is_there;
    vd along[3], slopes[3][2]; /* the direction along u, along v, and towards the face; derivatives */
    vd uv[2];
} cube_point;

TL_INLINE vd vd_negative(vd a) { return vd_sub(vd_set1(0.0), a); }

/* The parts of a direction along u (columns), along v (rows) and towards the face. */
TL_INLINE void onto_face(const cube_point *p, const vd *direction, vd *along)
{
    const vd x = direction[0], y = direction[1], z = direction[2];
    along[0] = vd_select(p->is_x, vd_negative(vd_mul(p->sign, z)), vd_select(p->is_y, x, vd_mul(p->sign, x)));
    along[1] = vd_select(p->is_y, vd_mul(p->sign, z), vd_negative(y));
    along[2] = vd_mul(p->sign, vd_select(p->is_x, x, vd_select(p->is_y, y, z)));
}

/* The inverse of `onto_face`. */
TL_INLINE void off_face(const cube_point *p, const vd *along, vd *direction)
{
    const vd u = along[0], v = along[1], w = vd_mul(p->sign, along[2]);
    direction[0] = vd_select(p->is_x, w, vd_select(p->is_y, u, vd_mul(p->sign, u)));
    direction[1] = vd_select(p->is_y, w, vd_negative(v));
    direction[2] = vd_select(p->is_x, vd_negative(vd_mul(p->sign, u)), vd_select(p->is_y, vd_mul(p->sign, v), w));
}

/* The points where directions meet the cube. */
TL_INLINE cube_point meet_cube(const vd *direction)
{
    cube_point p;
    const vd x = vd_abs(direction[0]), y = vd_abs(direction[1]), z = vd_abs(direction[2]), zero = vd_set1(0.0);
    const vm is_xy = vd_ge(vd_max(x, y), z);
    p.is_x = vm_and(is_xy, vd_ge(x, y)), p.is_y = vm_and_not(is_xy, p.is_x);
    const vd most = vd_select(p.is_x, direction[0], vd_select(p.is_y, direction[1], direction[2]));
    const vm is_front = vd_ge(most, zero), is_finite = vd_ge(vd_set1(DBL_MAX), vd_max(x, vd_max(y, z)));
    const vm are_numbers = vm_and(vd_ge(x, zero), vm_and(vd_ge(y, zero), vd_ge(z, zero)));
    p.is_there = vm_and(vm_and(is_finite, are_numbers), vm_and_not(vm_all(), vd_ge(zero, vd_abs(most))));
    p.face = vi_select(p.is_x, vi_set1(0), vi_select(p.is_y, vi_set1(2), vi_set1(4)));
    p.face = vi_add(p.face, vi_select(is_front, vi_set1(0), vi_set1(1)));
    p.sign = vd_select(is_front, vd_set1(1.0), vd_set1(-1.0));
    onto_face(&p, direction, p.along);
    for (int j = 0; j < 2; j++) {
        const vd at = vd_add(vd_mul(vd_div(p.along[j], p.along[2]), vd_set1(0.5)), vd_set1(0.5));
        p.uv[j] = vd_select(p.is_there, vd_min(vd_max(at, zero), vd_set1(1.0)), zero);
    }
    return p;
}

/* The derivatives of u and v, from the derivatives of directions along x and along y, (3, 2). */
TL_INLINE void slopes_on_face(cube_point *p, const vd *by, vd *slopes)
{
    for (int c = 0; c < 2; c++) {
        const vd one[3] = {by[c], by[2 + c], by[4 + c]};
        vd along[3];
        onto_face(p, one, along);
        for (int j = 0; j < 3; j++)
            p->slopes[j][c] = along[j];
        for (int j = 0; j < 2; j++) {
            const vd at = vd_div(p->along[j], p->along[2]), step = vd_sub(along[j], vd_mul(at, along[2]));
            slopes[2 * j + c] = vd_mul(vd_div(step, p->along[2]), vd_set1(0.5));
        }
    }
}

/* Gradients of directions (3) and of their derivatives (3, 2) from the gradients of u, v and the slopes; without
 * has_slopes of the directions alone. */
TL_INLINE void backward_cube(const cube_point *p, const vd *g_uv, const vd *g_slopes, vd *g_direction, vd *g_by,
                             int has_slopes)
{
    const vd zero = vd_set1(0.0), half = vd_set1(0.5), d = p->along[2];
    vd along[3] = {zero, zero, zero}, by[2][3] = {{zero, zero, zero}, {zero, zero, zero}};
    for (int j = 0; j < 2; j++) {
        const vd at = vd_div(p->along[j], d);
        const vm is_in = vd_ge(vd_set1(1.0), vd_abs(at));
        vd g_at = vd_select(is_in, vd_mul(g_uv[j], half), zero);
        for (int c = 0; has_slopes && c < 2; c++) {
            const vd g = vd_mul(vd_div(g_slopes[2 * j + c], d), half);
            const vd slope = vd_div(vd_sub(p->slopes[j][c], vd_mul(at, p->slopes[2][c])), d);
            by[c][j] = vd_add(by[c][j], g), by[c][2] = vd_sub(by[c][2], vd_mul(g, at));
            g_at = vd_sub(g_at, vd_mul(g, p->slopes[2][c]));
            along[2] = vd_sub(along[2], vd_mul(g, slope));
        }
        along[j] = vd_add(along[j], vd_div(g_at, d));
        along[2] = vd_sub(along[2], vd_div(vd_mul(g_at, at), d));
    }
    off_face(p, along, g_direction);
    for (int c = 0; has_slopes && c < 2; c++) {
        vd one[3];
        off_face(p, by[c], one);
        for (int k = 0; k < 3; k++)
            g_by[2 * k + c] = one[k];
    }
}

/* Moves texels of columns x and rows y beyond an edge of their face to the face that they project to. */
TL_INLINE void cross_edges(const cube_point *from, int64_t n, vi *face, vi *x, vi *y)
{
    const vd size = vd_set1((double)n), one = vd_set1(1.0), scale = vd_set1(2.0 / (double)n), half = vd_set1(0.5);
    const vi last = vi_set1((int32_t)n - 1);
    const vd along[3] = {vd_sub(vd_mul(vd_add(vd_from_vi(*x), half), scale), one),
                         vd_sub(vd_mul(vd_add(vd_from_vi(*y), half), scale), one), one};
    vd direction[3];
    off_face(from, along, direction);
    const cube_point p = meet_cube(direction);
    *face = p.face;
    *x = vi_min(vi_round(vd_floor(vd_mul(p.uv[0], size))), last);
    *y = vi_min(vi_round(vd_floor(vd_mul(p.uv[1], size))), last);
}

#endif
