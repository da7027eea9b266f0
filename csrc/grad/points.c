/* Where pixels lie in the triangles that they show: weights, z/w, and what the weights change by from pixel to pixel;
 * and backwards, from gradients of these to sums of gradients by vertex.
 * In: ids of a picture.  Out: `rast`, `rast_db`; backward: sums of x, y, z, w.
 *
 * With X, Y the pixel's middle and x' = x - X w, y' = y - Y w of each corner, a_k = x'_i y'_j - y'_i x'_j of the other
 * two corners; weights are a_k / (a_0 + a_1 + a_2).
 *
 * Based on: Laine, S. et al., "Modular Primitives for High-Performance Differentiable Rendering", 2020, section 3. */
#ifndef TL_GRAD_POINTS_C
#define TL_GRAD_POINTS_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/inline.h"
#include "grad/pixels.h"

typedef double group_reals[TL_GROUP];

/* What is computed of a group of pixels. */
typedef struct {
    group_reals middle[2];   /* X, Y */
    group_reals p[4][3];     /* x', y', z, w of the corners */
    group_reals a[3], total; /* total: 1 for 0 */
    group_reals zw;          /* not clamped */
    group_reals by[2][3];    /* what a_k change by along x and along y */
    double scale[2];
} weighed_group;

/* The same backward. */
typedef struct {
    group_reals weight[2], zw, db[4]; /* gradients of u, v, z/w and of du/dX, du/dY, dv/dX, dv/dY */
    group_reals p[4][3];              /* of the corners */
} group_gradients;

/* Loads the corners of a group, and moves them so that the pixel is the origin. */
TL_INLINE void load_group(const tl_grad_view *view, const pixel_group *group, weighed_group *g, int is_f64)
{
    for (int i = 0; i < group->n; i++) {
        g->middle[0][i] = (2.0 * (double)group->column[i] + 1.0) * view->scale[0] + view->shift[0];
        g->middle[1][i] = (2.0 * (double)group->row[i] + 1.0) * view->scale[1] + view->shift[1];
        if (i && group->id[i] == group->id[i - 1]) {
            for (int c = 0; c < 4; c++)
                for (int k = 0; k < 3; k++)
                    g->p[c][k][i] = g->p[c][k][i - 1];
            continue;
        }
        for (int k = 0; k < 3; k++) {
            const int64_t vertex = view->tri[3 * (int64_t)group->id[i] + k];
            for (int c = 0; c < 4; c++)
                g->p[c][k][i] = get_real(view->pos, 4 * vertex + c, is_f64);
        }
    }
    for (int axis = 0; axis < 2; axis++) {
        g->scale[axis] = 2.0 * view->scale[axis];
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < group->padded; i++)
                g->p[axis][k][i] -= g->middle[axis][i] * g->p[3][k][i];
    }
}

static const int next_corner[3] = {1, 2, 0}, last_corner[3] = {2, 0, 1};

/* a_k, their sum, and z/w. */
TL_INLINE void weigh_group(weighed_group *g, int n)
{
    for (int k = 0; k < 3; k++) {
        const double *x1 = g->p[0][next_corner[k]], *y1 = g->p[1][next_corner[k]];
        const double *x2 = g->p[0][last_corner[k]], *y2 = g->p[1][last_corner[k]];
        for (int i = 0; i < n; i++)
            g->a[k][i] = x1[i] * y2[i] - y1[i] * x2[i];
    }
    for (int i = 0; i < n; i++) {
        const double total = g->a[0][i] + g->a[1][i] + g->a[2][i];
        g->total[i] = total == 0.0 ? 1.0 : total;
        const double over = g->p[2][0][i] * g->a[0][i] + g->p[2][1][i] * g->a[1][i] + g->p[2][2][i] * g->a[2][i];
        const double under = g->p[3][0][i] * g->a[0][i] + g->p[3][1][i] * g->a[1][i] + g->p[3][2][i] * g->a[2][i];
        g->zw[i] = over / (under == 0.0 ? 1.0 : under);
    }
}

/* What a_k change by from pixel to pixel. */
TL_INLINE void slope_group(weighed_group *g, int n)
{
    for (int k = 0; k < 3; k++) {
        const double *x1 = g->p[0][next_corner[k]], *y1 = g->p[1][next_corner[k]], *w1 = g->p[3][next_corner[k]];
        const double *x2 = g->p[0][last_corner[k]], *y2 = g->p[1][last_corner[k]], *w2 = g->p[3][last_corner[k]];
        for (int i = 0; i < n; i++) {
            g->by[0][k][i] = g->scale[0] * (y1[i] * w2[i] - w1[i] * y2[i]);
            g->by[1][k][i] = g->scale[1] * (w1[i] * x2[i] - x1[i] * w2[i]);
        }
    }
}

/* Writes a group; weights are clamped to a sum of at most 1, z/w to -1..1. */
TL_INLINE void store_group(const pixel_group *group, const weighed_group *g, void *rast, void *rast_db, int is_f64)
{
    for (int i = 0; i < group->n; i++) {
        const int64_t at = 4 * group->at[i];
        const double r = 1.0 / g->total[i], u = g->a[0][i] * r, v = g->a[1][i] * r;
        const double u_in = clamped(u, 0.0, 1.0), v_in = clamped(v, 0.0, 1.0), sum = u_in + v_in;
        put_real(rast, at, sum > 1.0 ? u_in / sum : u_in, is_f64);
        put_real(rast, at + 1, sum > 1.0 ? v_in / sum : v_in, is_f64);
        put_real(rast, at + 2, clamped(g->zw[i], -1.0, 1.0), is_f64);
        put_id(rast, group->at[i], group->id[i], is_f64);
        for (int axis = 0; rast_db && axis < 2; axis++) {
            const double sum_by = g->by[axis][0][i] + g->by[axis][1][i] + g->by[axis][2][i];
            put_real(rast_db, at + axis, (g->by[axis][0][i] - u * sum_by) * r, is_f64);
            put_real(rast_db, at + 2 + axis, (g->by[axis][1][i] - v * sum_by) * r, is_f64);
        }
    }
}

/* The next pixels of rows of ids, which lie `step` apart. */
TL_INLINE int next_ids(const tl_grad_view *view, const int32_t *ids, int64_t step, int64_t first_id, band_place *place,
                       pixel_group *group)
{
    for (group->n = 0; place->row < view->end_row; place->row++, place->column = 0)
        for (const int32_t *row = ids + step * place->row; place->column < view->width; place->column++) {
            const int32_t id = row[place->column];
            if (id < 0 || !has_corners(view, view->n_vertices, (int32_t)(id + first_id)))
                continue;
            if (group->n == TL_GROUP)
                goto full;
            add_pixel(group, place, view->width, (int32_t)(id + first_id));
        }
full:
    group->padded = (group->n + 7) & ~7;
    return group->n;
}

TL_INLINE void points_of_ids(const tl_grad_view *view, const int32_t *ids, int64_t step, int64_t first_id, void *rast,
                             void *rast_db, int is_f64)
{
    band_place place;
    pixel_group group;
    weighed_group g;
    memset(&g, 0, sizeof g);
    start_band(view, &place, &group);
    while (next_ids(view, ids, step, first_id, &place, &group)) {
        load_group(view, &group, &g, is_f64);
        weigh_group(&g, group.padded);
        if (rast_db)
            slope_group(&g, group.padded);
        store_group(&group, &g, rast, rast_db, is_f64);
    }
}

/* See kernels.h. */
static void grad_points(const tl_grad_view *view, const int32_t *ids, int64_t step, int64_t first_id, void *rast,
                        void *rast_db)
{
    if (view->is_f64)
        points_of_ids(view, ids, step, first_id, rast, rast_db, 1);
    else
        points_of_ids(view, ids, step, first_id, rast, rast_db, 0);
}

/* Gradients of a_k and of the corners from those of the weights, of z/w and of the derivatives. */
TL_INLINE void pull_weights(const weighed_group *g, const group_gradients *d, int i, int has_db, double *g_a,
                            double g_by[2][3])
{
    const double live = g->a[0][i] + g->a[1][i] + g->a[2][i] == 0.0 ? 0.0 : 1.0, r = live / g->total[i];
    const double u = g->a[0][i] * r, v = g->a[1][i] * r;
    const double u_in = clamped(u, 0.0, 1.0), v_in = clamped(v, 0.0, 1.0), sum = u_in + v_in;
    const double s = sum > 1.0 ? 1.0 / sum : 1.0;
    const double g_sum = sum > 1.0 ? (d->weight[0][i] * u_in + d->weight[1][i] * v_in) * s * s : 0.0;
    double g_u = u == u_in ? d->weight[0][i] * s - g_sum : 0.0, g_v = v == v_in ? d->weight[1][i] * s - g_sum : 0.0;
    double g_total = 0.0;
    for (int axis = 0; has_db && axis < 2; axis++) {
        const double by_sum = g->by[axis][0][i] + g->by[axis][1][i] + g->by[axis][2][i];
        const double g_du = d->db[axis][i] * r, g_dv = d->db[2 + axis][i] * r, both = g_du * u + g_dv * v;
        g_by[axis][0] = g_du - both, g_by[axis][1] = g_dv - both, g_by[axis][2] = -both;
        g_u -= g_du * by_sum, g_v -= g_dv * by_sum;
        g_total -= g_du * (g->by[axis][0][i] - u * by_sum) * r + g_dv * (g->by[axis][1][i] - v * by_sum) * r;
    }
    g_total -= (g_u * u + g_v * v) * r;
    g_a[0] = g_u * r + g_total, g_a[1] = g_v * r + g_total, g_a[2] = g_total;
}

/* Gradients of the corners: of p' first, then of what was moved. */
TL_INLINE void pull_group(const weighed_group *g, group_gradients *d, int n, int has_db)
{
    for (int i = 0; i < n; i++) {
        double g_a[3], g_by[2][3] = {{0}}, out[4][3] = {{0}};
        pull_weights(g, d, i, has_db, g_a, g_by);
        const double under = g->p[3][0][i] * g->a[0][i] + g->p[3][1][i] * g->a[1][i] + g->p[3][2][i] * g->a[2][i];
        const int is_in = under != 0.0 && g->zw[i] >= -1.0 && g->zw[i] <= 1.0;
        const double g_over = is_in ? d->zw[i] / under : 0.0, g_under = -g_over * (is_in ? g->zw[i] : 0.0);
        for (int k = 0; k < 3; k++) {
            g_a[k] += g_over * g->p[2][k][i] + g_under * g->p[3][k][i];
            out[2][k] += g_over * g->a[k][i];
            out[3][k] += g_under * g->a[k][i];
        }
        for (int k = 0; k < 3; k++) {
            const int k1 = next_corner[k], k2 = last_corner[k];
            const double x1 = g->p[0][k1][i], y1 = g->p[1][k1][i], w1 = g->p[3][k1][i];
            const double x2 = g->p[0][k2][i], y2 = g->p[1][k2][i], w2 = g->p[3][k2][i];
            const double by_x = has_db ? g_by[0][k] * g->scale[0] : 0.0, by_y = has_db ? g_by[1][k] * g->scale[1] : 0.0;
            out[0][k1] += g_a[k] * y2 - by_y * w2, out[1][k1] += by_x * w2 - g_a[k] * x2;
            out[0][k2] += by_y * w1 - g_a[k] * y1, out[1][k2] += g_a[k] * x1 - by_x * w1;
            out[3][k1] += by_y * x2 - by_x * y2, out[3][k2] += by_x * y1 - by_y * x1;
        }
        for (int k = 0; k < 3; k++) {
            out[3][k] -= g->middle[0][i] * out[0][k] + g->middle[1][i] * out[1][k];
            for (int c = 0; c < 4; c++)
                d->p[c][k][i] = out[c][k];
        }
    }
}

/* Adds the gradients of a group to the sums of vertices, pixel by pixel. */
TL_INLINE void add_group(const tl_grad_view *view, const pixel_group *group, const group_gradients *d,
                         tl_grad_sums *sums)
{
    double *to[3] = {0};
    for (int i = 0; i < group->n; i++) {
        if (!i || group->id[i] != group->id[i - 1])
            corner_sums(view, sums, group->id[i], to);
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 4; c++)
                to[k][c] += d->p[c][k][i];
    }
}

TL_INLINE int64_t pull_points(const tl_grad_view *view, const void *rast, const void *g_rast, const void *g_db,
                              tl_grad_sums *sums, int is_f64)
{
    band_place place;
    pixel_group group;
    weighed_group g;
    group_gradients d;
    memset(&g, 0, sizeof g);
    memset(&d, 0, sizeof d);
    start_band(view, &place, &group);
    while (next_group(view, rast, view->n_vertices, &place, &group, is_f64)) {
        load_group(view, &group, &g, is_f64);
        weigh_group(&g, group.padded);
        if (g_db)
            slope_group(&g, group.padded);
        for (int i = 0; i < group.n; i++) {
            const int64_t at = 4 * group.at[i];
            d.weight[0][i] = get_real(g_rast, at, is_f64), d.weight[1][i] = get_real(g_rast, at + 1, is_f64);
            d.zw[i] = get_real(g_rast, at + 2, is_f64);
            for (int c = 0; g_db && c < 4; c++)
                d.db[c][i] = get_real(g_db, at + c, is_f64);
        }
        if (g_db)
            pull_group(&g, &d, group.padded, 1);
        else
            pull_group(&g, &d, group.padded, 0);
        add_group(view, &group, &d, sums);
    }
    leave_band(sums);
    return place.bad_id;
}

/* See kernels.h. */
static int64_t grad_points_vjp(const tl_grad_view *view, const void *rast, const void *g_rast, const void *g_db,
                               tl_grad_sums *sums)
{
    return view->is_f64 ? pull_points(view, rast, g_rast, g_db, sums, 1)
                        : pull_points(view, rast, g_rast, g_db, sums, 0);
}

#endif
