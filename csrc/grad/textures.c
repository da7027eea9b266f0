/* Textures at pixels: the nearest texel, four of them, and those of one or two halvings; and backwards.
 * In: levels, where to look, footprints.  Out: pictures; backward: gradients of what is looked up, sums by texel. */
#ifndef TL_GRAD_TEXTURES_C
#define TL_GRAD_TEXTURES_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/inline.h"
#include "grad/cube.c"
#include "grad/pixels.h"

/* Texels of a level: their rows, shares, and what the shares change by with u and with v. */
typedef struct {
    int n;
    int64_t row[4];
    double share[4], by[2][4];
} texel_shares;

/* Where a pixel looks. */
typedef struct {
    int low, n_levels; /* the lower of one level or two */
    double upper;      /* share of the upper one */
    double uv[2];
    int is_kept[2]; /* whether u, v are numbers */
    cube_point cube;
} looked_up;

/* log2 of a positive number, by ln(m) = 2 atanh((m - 1) / (m + 1)), m from sqrt(1/2) to sqrt(2): those of libraries
 * differ from processor to processor. */
TL_ONCE double log2_fully(double a)
{
    int exponent;
    double m = frexp(a, &exponent), sum = 0.0;
    if (m < 0x1.6a09e667f3bcdp-1)
        m *= 2.0, exponent--;
    const double s = (m - 1.0) / (m + 1.0), square = s * s;
    for (int k = 23; k > 0; k -= 2)
        sum = sum * square + 1.0 / k;
    return exponent + s * sum * 2.8853900817779268;
}

/* The texel of column x and row y: its row in the level; a share of 0 where nothing is there. */
TL_INLINE int64_t place_texel(const tl_grad_texture *t, int level, int face, int64_t x, int64_t y, int *is_there)
{
    const int64_t width = t->widths[level], height = t->heights[level];
    const int is_in = x >= 0 && x < width && y >= 0 && y < height;
    *is_there = 1;
    if (!is_in && t->edge == TL_EDGE_WRAP) { /* by one at most */
        x = x < 0 ? width - 1 : x >= width ? 0 : x;
        y = y < 0 ? height - 1 : y >= height ? 0 : y;
    } else if (!is_in) {
        *is_there = t->edge != TL_EDGE_ZERO;
        if (t->edge == TL_EDGE_CUBE && (x >= 0 && x < width) != (y >= 0 && y < height))
            cross_edge(width, &face, &x, &y);
        else if (t->edge == TL_EDGE_CUBE)
            *is_there = 0; /* beyond a corner: the mean of the others */
        x = x < 0 ? 0 : x >= width ? width - 1 : x;
        y = y < 0 ? 0 : y >= height ? height - 1 : y;
    }
    return (face * height + y) * width + x;
}

/* The place along an axis in texels, and what it changes by with u. */
TL_INLINE double along_axis(const tl_grad_texture *t, double u, int64_t size, double half, double *by)
{
    const double n = (double)size, last = n - 1.0;
    if (t->edge == TL_EDGE_WRAP)
        u -= floor(u);
    const double at = u * n - half, low = t->edge == TL_EDGE_CLAMP ? 0.0 : -2.0;
    const double high = t->edge == TL_EDGE_CLAMP ? last : n + 1.0;
    *by = at >= low && at <= high ? n : 0.0;
    return clamped(at, low, high);
}

/* The four texels about a point, or the nearest. */
TL_INLINE texel_shares find_shares(const tl_grad_texture *t, const looked_up *at, int level, int is_nearest)
{
    texel_shares quad = {.n = is_nearest ? 1 : 4};
    double by[2], place[2], part[2];
    int64_t first[2];
    int is_there[4], n_there = 0;
    const int face = t->edge == TL_EDGE_CUBE ? at->cube.face : 0;
    const int64_t size[2] = {t->widths[level], t->heights[level]};
    for (int axis = 0; axis < 2; axis++) {
        place[axis] = along_axis(t, at->uv[axis], size[axis], is_nearest ? 0.0 : 0.5, &by[axis]);
        const double low = floor(place[axis]);
        part[axis] = place[axis] - low, first[axis] = (int64_t)low;
        by[axis] *= at->is_kept[axis];
    }
    if (is_nearest && t->edge == TL_EDGE_CUBE)
        for (int axis = 0; axis < 2; axis++)
            first[axis] = first[axis] >= size[axis] ? size[axis] - 1 : first[axis];
    for (int k = 0; k < quad.n; k++) {
        const int dx = k & 1, dy = k >> 1;
        quad.row[k] = place_texel(t, level, face, first[0] + dx, first[1] + dy, &is_there[k]);
        const double x = dx ? part[0] : 1.0 - part[0], y = dy ? part[1] : 1.0 - part[1];
        quad.share[k] = is_nearest ? 1.0 : x * y;
        quad.by[0][k] = is_nearest ? 0.0 : (dx ? by[0] : -by[0]) * y;
        quad.by[1][k] = is_nearest ? 0.0 : (dy ? by[1] : -by[1]) * x;
        n_there += is_there[k];
    }
    for (int k = 0; n_there < quad.n && k < quad.n; k++) {
        if (is_there[k])
            continue;
        const double shared[3] = {quad.share[k] / 3.0, quad.by[0][k] / 3.0, quad.by[1][k] / 3.0};
        for (int j = 0; t->edge == TL_EDGE_CUBE && n_there == 3 && j < 4; j++)
            if (j != k)
                quad.share[j] += shared[0], quad.by[0][j] += shared[1], quad.by[1][j] += shared[2];
        quad.share[k] = quad.by[0][k] = quad.by[1][k] = 0.0;
    }
    return quad;
}

/* The longer axis of a footprint in texels, as a level, and what that changes by with each slope. */
TL_INLINE double footprint_level(const tl_grad_texture *t, const double *slopes, double *by)
{
    const double w = (double)t->widths[0], h = (double)t->heights[0];
    const double s_x = slopes[0] * w, s_y = slopes[1] * w, t_x = slopes[2] * h, t_y = slopes[3] * h;
    const double a = s_x * s_x + t_x * t_x, b = s_y * s_y + t_y * t_y, c = s_x * s_y + t_x * t_y;
    const double e = (a - b) / 2.0, under = e * e + c * c;
    const double root = sqrt(under > 1e-30 ? under : 1e-30), square = (a + b) / 2.0 + root;
    const double scale = square > 1e-30 ? 0.72134752044448170 / square : 0.0,
                 in_root = under > 1e-30 ? 0.5 / root : 0.0;
    const double by_a = scale * (0.5 + e * in_root), by_b = scale * (0.5 - e * in_root),
                 by_c = scale * 2.0 * c * in_root;
    by[0] = w * (2.0 * by_a * s_x + by_c * s_y), by[1] = w * (2.0 * by_b * s_y + by_c * s_x);
    by[2] = h * (2.0 * by_a * t_x + by_c * t_y), by[3] = h * (2.0 * by_b * t_y + by_c * t_x);
    return 0.5 * log2_fully(square > 1e-30 ? square : 1e-30);
}

/* What a pixel looks at; `by` is what its level changes by with the slopes of u and v.  n_levels is 0 for nothing. */
TL_INLINE looked_up look_at(const tl_grad_texture *t, int64_t pixel, double *by, int is_f64)
{
    looked_up at = {.n_levels = 1, .is_kept = {1, 1}};
    double slopes[6], direction[3];
    const int n_axes = t->edge == TL_EDGE_CUBE ? 3 : 2;
    for (int k = 0; t->uv_da && k < 2 * n_axes; k++)
        slopes[k] = get_real(t->uv_da, 2 * n_axes * pixel + k, is_f64);
    for (int k = 0; k < n_axes; k++)
        direction[k] = get_real(t->uv, n_axes * pixel + k, is_f64);
    if (n_axes == 3) {
        at.cube = meet_cube(direction, t->uv_da ? slopes : 0);
        at.n_levels = at.cube.face >= 0;
        memcpy(direction, at.cube.uv, sizeof at.cube.uv);
        memcpy(slopes, at.cube.slopes, sizeof at.cube.slopes);
    }
    for (int k = 0; k < 2; k++) {
        at.is_kept[k] = isfinite(direction[k]) != 0;
        at.uv[k] = at.is_kept[k] ? direction[k] : 0.0;
    }
    by[0] = by[1] = by[2] = by[3] = 0.0;
    if (t->filter < TL_TEXEL_LEVEL)
        return at;
    double level = t->uv_da ? footprint_level(t, slopes, by) : 0.0;
    level += t->bias ? get_real(t->bias, pixel, is_f64) : 0.0;
    if (!(level == level))
        at.n_levels = 0;
    level = clamped(level, 0.0, (double)(t->n_levels - 1));
    at.low = (int)(t->filter == TL_TEXEL_LEVEL ? rint(level) : floor(level == level ? level : 0.0));
    at.upper = t->filter == TL_TEXEL_LEVEL ? 0.0 : level - at.low;
    at.n_levels += at.n_levels && at.upper > 0.0;
    return at;
}

TL_INLINE void texels_of(const tl_grad_view *view, const tl_grad_texture *t, int is_f64)
{
    for (int64_t pixel = view->first_row * view->width; pixel < view->end_row * view->width; pixel++) {
        double by[4];
        const looked_up at = look_at(t, pixel, by, is_f64);
        texel_shares quads[2];
        for (int k = 0; k < at.n_levels; k++)
            quads[k] = find_shares(t, &at, at.low + k, t->filter == TL_TEXEL_NEAREST);
        for (int64_t c = 0; c < t->n_channels; c++) {
            double sum = 0.0;
            for (int k = 0; k < at.n_levels; k++) {
                double found = 0.0;
                for (int j = 0; j < quads[k].n; j++)
                    found += quads[k].share[j] *
                             get_real(t->levels[at.low + k], t->n_channels * quads[k].row[j] + c, is_f64);
                sum += (k ? at.upper : 1.0 - at.upper) * found;
            }
            put_real(t->out, t->n_channels * pixel + c, sum, is_f64);
        }
    }
}

/* See kernels.h. */
static void grad_texels(const tl_grad_view *view, const tl_grad_texture *texture)
{
    if (view->is_f64)
        texels_of(view, texture, 1);
    else
        texels_of(view, texture, 0);
}

/* Adds a pixel's gradients to its texels of a level; returns those of u and v, and the sum of gradient and value. */
TL_INLINE double pull_shares(const tl_grad_texture *t, const texel_shares *quad, int level, int64_t pixel, double share,
                             double *g_uv, tl_grad_sums *sums, int is_f64)
{
    double total = 0.0;
    for (int j = 0; j < quad->n; j++) {
        if (quad->share[j] == 0.0 && quad->by[0][j] == 0.0 && quad->by[1][j] == 0.0)
            continue;
        double *to = sums_of(sums, t->first_texels[level] + quad->row[j]), by_value = 0.0;
        for (int64_t c = 0; c < t->n_channels; c++) {
            const double g = get_real(t->out, t->n_channels * pixel + c, is_f64);
            to[c] += share * quad->share[j] * g;
            by_value += g * get_real(t->levels[level], t->n_channels * quad->row[j] + c, is_f64);
        }
        total += quad->share[j] * by_value;
        g_uv[0] += share * quad->by[0][j] * by_value, g_uv[1] += share * quad->by[1][j] * by_value;
    }
    return total;
}

/* Writes the gradients of what a pixel looks at. */
TL_INLINE void store_looks(const tl_grad_texture *t, const looked_up *at, int64_t pixel, double *g_uv, double g_level,
                           const double *by, int is_f64)
{
    double g_slopes[6] = {0}, g_direction[3] = {0};
    for (int k = 0; k < 4; k++)
        g_slopes[k] = g_level * by[k];
    if (t->edge == TL_EDGE_CUBE) {
        double g_by[6] = {0};
        if (at->n_levels)
            pull_cube(&at->cube, g_uv, g_slopes, g_direction, t->g_uv_da ? g_by : 0);
        memcpy(g_slopes, g_by, sizeof g_by);
        g_uv = g_direction;
    }
    const int n_axes = t->edge == TL_EDGE_CUBE ? 3 : 2;
    for (int k = 0; k < n_axes; k++)
        put_real(t->g_uv, n_axes * pixel + k, g_uv[k], is_f64);
    for (int k = 0; t->g_uv_da && k < 2 * n_axes; k++)
        put_real(t->g_uv_da, 2 * n_axes * pixel + k, g_slopes[k], is_f64);
    if (t->g_bias)
        put_real(t->g_bias, pixel, g_level, is_f64);
}

/* Whether some channel of a pixel has a gradient. */
TL_INLINE int is_pulled(const tl_grad_texture *t, int64_t pixel, int is_f64)
{
    int found = 0;
    for (int64_t c = 0; c < t->n_channels; c++)
        found |= get_real(t->out, t->n_channels * pixel + c, is_f64) != 0.0;
    return found;
}

TL_INLINE void pull_texels(const tl_grad_view *view, const tl_grad_texture *t, tl_grad_sums *sums, int is_f64)
{
    const int n_axes = t->edge == TL_EDGE_CUBE ? 3 : 2;
    clear_band(view, t->g_uv, n_axes);
    clear_band(view, t->g_uv_da, 2 * n_axes);
    clear_band(view, t->g_bias, 1);
    for (int64_t pixel = view->first_row * view->width; pixel < view->end_row * view->width; pixel++) {
        if (!is_pulled(t, pixel, is_f64))
            continue;
        double by[4], g_uv[3] = {0}, total[2] = {0};
        const looked_up at = look_at(t, pixel, by, is_f64);
        for (int k = 0; k < at.n_levels; k++) {
            const texel_shares quad = find_shares(t, &at, at.low + k, t->filter == TL_TEXEL_NEAREST);
            total[k] = pull_shares(t, &quad, at.low + k, pixel, k ? at.upper : 1.0 - at.upper, g_uv, sums, is_f64);
        }
        store_looks(t, &at, pixel, g_uv, at.n_levels > 1 ? total[1] - total[0] : 0.0, by, is_f64);
    }
    leave_band(sums);
}

/* See kernels.h. */
static void grad_texels_vjp(const tl_grad_view *view, const tl_grad_texture *texture, tl_grad_sums *sums)
{
    if (view->is_f64)
        pull_texels(view, texture, sums, 1);
    else
        pull_texels(view, texture, sums, 0);
}

#endif
