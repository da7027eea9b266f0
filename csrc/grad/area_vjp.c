/* Gradients of vertices from the gradients of exact covered areas: an edge moves area at a rate of its length in a
 * pixel.
 * In: vertices in pixels, gradients by pixel.  Out: gradients of vertices.
 *
 * An edge from a to b with the outward normal N, |N| = |b - a|, that lies in a pixel from s0 to s1 (0 at a, 1 at b) has
 * d area / d a = N ((s1 - s0) - (s1^2 - s0^2) / 2) and d area / d b = N (s1^2 - s0^2) / 2.
 *
 * Based on: Auzinger, T., Guthe, M., Jeschke, S., "Analytic Anti-Aliasing of Linear Functions on Polytopes", 2012; Li,
 * T.-M. et al., "Differentiable Vector Graphics Rasterization for Editing and Learning", 2020. */
#ifndef TL_GRAD_AREA_VJP_C
#define TL_GRAD_AREA_VJP_C

#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/inline.h"
#include "grad/grad.h"

/* The gradient of the area of a triangle in a pixel. */
TL_INLINE double area_gradient(const tl_grad_area *p, int64_t triangle, int64_t pixel)
{
    double sum = 0.0;
    for (int64_t c = 0; c < p->n_channels; c++)
        sum += p->grad[p->n_channels * pixel + c] * (p->values ? p->values[p->n_channels * triangle + c] : 1.0);
    return sum;
}

/* Clips [s[0], s[1]] to where a coordinate lies in [0, size]. */
TL_INLINE void cut_to(double from, double by, double size, double *s)
{
    if (by == 0.0) {
        s[1] = from >= 0.0 && from <= size ? s[1] : -1.0;
        return;
    }
    const double low = (by > 0.0 ? -from : size - from) / by, high = (by > 0.0 ? size - from : -from) / by;
    s[0] = low > s[0] ? low : s[0], s[1] = high < s[1] ? high : s[1];
}

/* The pixel of a coordinate; between two pixels the pixel that the edge enters. */
TL_INLINE int64_t pixel_into(double at, double by, int64_t size)
{
    const double low = floor(at);
    const int64_t pixel = (int64_t)low - (by < 0.0 && low == at);
    return pixel < 0 ? 0 : pixel >= size ? size - 1 : pixel;
}

/* Adds the gradients of the ends of an edge, pixel by pixel. */
static void backward_area_edge(const tl_grad_area *p, int64_t triangle, int32_t first, int32_t last, double sign)
{
    const double *a = p->points_px + 2 * (int64_t)first, *b = p->points_px + 2 * (int64_t)last;
    const double by[2] = {b[0] - a[0], b[1] - a[1]}, size[2] = {(double)p->width, (double)p->height};
    const int64_t n[2] = {p->width, p->height};
    double s[2] = {0.0, 1.0}, at_a = 0.0, at_b = 0.0, next[2];
    int64_t pixel[2];
    cut_to(a[0], by[0], size[0], s);
    cut_to(a[1], by[1], size[1], s);
    if (!(s[0] < s[1]))
        return;
    for (int axis = 0; axis < 2; axis++) {
        pixel[axis] = pixel_into(a[axis] + s[0] * by[axis], by[axis], n[axis]);
        next[axis] = by[axis] == 0.0 ? INFINITY : ((double)(pixel[axis] + (by[axis] > 0.0)) - a[axis]) / by[axis];
    }
    for (double from = s[0]; from < s[1];) {
        const int axis = next[1] < next[0];
        const double to = next[axis] < s[1] ? next[axis] : s[1];
        if (to > from) {
            const double g = area_gradient(p, triangle, pixel[1] * p->width + pixel[0]),
                         half = 0.5 * (to * to - from * from);
            at_a += g * (to - from - half), at_b += g * half;
            from = to;
        }
        pixel[axis] += by[axis] > 0.0 ? 1 : -1;
        if (to >= s[1] || pixel[axis] < 0 || pixel[axis] >= n[axis])
            break;
        next[axis] = ((double)(pixel[axis] + (by[axis] > 0.0)) - a[axis]) / by[axis];
    }
    double *out_a = p->out + 2 * (int64_t)first, *out_b = p->out + 2 * (int64_t)last;
    out_a[0] += sign * by[1] * at_a, out_a[1] -= sign * by[0] * at_a;
    out_b[0] += sign * by[1] * at_b, out_b[1] -= sign * by[0] * at_b;
}

/* See kernels.h. */
static void grad_area(const tl_grad_area *p)
{
    for (int64_t i = 0; i < p->n_triangles; i++) {
        const int32_t *c = p->triangles + 3 * i;
        const double *a = p->points_px + 2 * (int64_t)c[0], *b = p->points_px + 2 * (int64_t)c[1];
        const double *d = p->points_px + 2 * (int64_t)c[2];
        const double area = (b[0] - a[0]) * (d[1] - a[1]) - (d[0] - a[0]) * (b[1] - a[1]);
        for (int k = 0; k < 3 && area != 0.0; k++)
            backward_area_edge(p, i, c[k], c[(k + 1) % 3], area > 0.0 ? 1.0 : -1.0);
    }
}

#endif
