/* Where pixels lie in the triangles that they show: weights, z/w, and what the weights change by from pixel to pixel;
 * and backwards, from gradients of these to sums of gradients by vertex.
 * In: ids of a picture.  Out: `rast`, `rast_db`; backward: sums of x, y, z, w.
 *
 * With X, Y a pixel's middle, about that (X0, Y0) of the first pixel that shows the triangle, and x' = x - X0 w,
 * y' = y - Y0 w of its corners, a_k = q_k . (X, Y, 1) with q_k the cross product of the other two corners (x', y', w).
 * Weights are
 * a_k / (a_0 + a_1 + a_2), so backward a triangle needs the sums of the gradients of a_k times X, Y and 1: those of its
 * corners follow from them at once.  What the weights change by has the first two numbers of q_k alone.
 *
 * Based on: Laine, S. et al., "Modular Primitives for High-Performance Differentiable Rendering", 2020, section 3. */
#ifndef TL_GRAD_POINTS_C
#define TL_GRAD_POINTS_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/inline.h"
#include "grad/pixels.h"

/* A triangle about a pixel. */
typedef struct {
    double x[3], y[3], z[3], w[3];
    double q[3][3]; /* q[k]: by X, by Y, and there */
    double sum[3];  /* of q[0], q[1], q[2] */
    double middle[2];
} grad_triangle;

TL_INLINE double middle_at(const tl_grad_view *view, int axis, int64_t i)
{
    return (2.0 * (double)i + 1.0) * view->scale[axis] + view->shift[axis];
}

TL_INLINE void load_seen_triangle(const tl_grad_view *view, int32_t id, double x, double y, grad_triangle *t,
                                  int is_f64)
{
    t->middle[0] = x, t->middle[1] = y;
    for (int k = 0; k < 3; k++) {
        const int64_t at = 4 * (int64_t)view->tri[3 * (int64_t)id + k];
        t->z[k] = get_real(view->pos, at + 2, is_f64), t->w[k] = get_real(view->pos, at + 3, is_f64);
        t->x[k] = get_real(view->pos, at, is_f64) - x * t->w[k];
        t->y[k] = get_real(view->pos, at + 1, is_f64) - y * t->w[k];
    }
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        t->q[k][0] = t->y[i] * t->w[j] - t->w[i] * t->y[j];
        t->q[k][1] = t->w[i] * t->x[j] - t->x[i] * t->w[j];
        t->q[k][2] = t->x[i] * t->y[j] - t->y[i] * t->x[j];
    }
    for (int c = 0; c < 3; c++)
        t->sum[c] = t->q[0][c] + t->q[1][c] + t->q[2][c];
}

/* A function of X and Y that has these numbers, in the row of the middle. */
TL_INLINE double plane_at(const double *q, double x) { return q[0] * x + q[2]; }

/* Writes pixel i of a run, X off the first: weights are clamped to a sum of at most 1, z/w to z_most. */
TL_INLINE void store_point(const tl_grad_view *view, const grad_triangle *t, const pixel_run *run, int64_t i, double x,
                           void *const *out, int is_f64)
{
    const int64_t at = 4 * (run->at + i);
    const double a[3] = {plane_at(t->q[0], x), plane_at(t->q[1], x), plane_at(t->q[2], x)};
    const double total = plane_at(t->sum, x), r = total == 0.0 ? 1.0 : 1.0 / total, u = a[0] * r, v = a[1] * r;
    const double over = t->z[0] * a[0] + t->z[1] * a[1] + t->z[2] * a[2];
    const double under = t->w[0] * a[0] + t->w[1] * a[1] + t->w[2] * a[2];
    double u_in = clamped(u, 0.0, 1.0), v_in = clamped(v, 0.0, 1.0);
    const double sum = u_in + v_in;
    if (sum > 1.0)
        u_in /= sum, v_in /= sum;
    put_real(out[0], at, u_in, is_f64), put_real(out[0], at + 1, v_in, is_f64);
    put_real(out[0], at + 2, clamped(over / (under == 0.0 ? 1.0 : under), -view->z_most, view->z_most), is_f64);
    put_id(out[0], run->at + i, run->id, is_f64);
    for (int axis = 0; out[1] && axis < 2; axis++) {
        const double step = 2.0 * view->scale[axis] * r;
        put_real(out[1], at + axis, (t->q[0][axis] - u * t->sum[axis]) * step, is_f64);
        put_real(out[1], at + 2 + axis, (t->q[1][axis] - v * t->sum[axis]) * step, is_f64);
    }
}

/* Rows of ids as `grad_points` has them. */
typedef struct {
    const int32_t *lowest;
    int64_t step, first_id;
} id_rows;

TL_INLINE void points_of_ids(const tl_grad_view *view, const id_rows *ids, void *const *out, int is_f64)
{
    grad_triangle t;
    pixel_run run = before_shown(view);
    clear_band(view, out[0], 4);
    clear_band(view, out[1], 4);
    for (; run.row < view->end_row; run.row++) {
        const int32_t *row = ids->lowest + ids->step * run.row;
        const double y = middle_at(view, 1, run.row);
        for (int64_t x = 0; x < view->width;) {
            const int32_t id = row[x];
            run.column = x++;
            if (id < 0)
                continue;
            while (x < view->width && row[x] == id)
                x++;
            run.id = (int32_t)(id + ids->first_id), run.n = x - run.column, run.at = run.row * view->width + run.column;
            if (!has_corners(view, view->n_vertices, run.id))
                continue;
            load_seen_triangle(view, run.id, middle_at(view, 0, run.column), y, &t, is_f64);
            for (int64_t i = 0; i < run.n; i++)
                store_point(view, &t, &run, i, 2.0 * view->scale[0] * (double)i, out, is_f64);
        }
    }
}

/* See kernels.h. */
static void grad_points(const tl_grad_view *view, const int32_t *ids, int64_t step, int64_t first_id, void *rast,
                        void *rast_db)
{
    const id_rows rows = {ids, step, first_id};
    void *const out[2] = {rast, rast_db};
    if (view->is_f64)
        points_of_ids(view, &rows, out, 1);
    else
        points_of_ids(view, &rows, out, 0);
}

/* Gradients at a pixel, of `rast` and of `rast_db`. */
typedef struct {
    double u, v, zw, db[4];
} point_gradients;

/* What a row of pixels sums up. */
typedef struct {
    double a[3], a_x[3]; /* gradients of a_k, and times X */
    double q[3][2];      /* of q_k alone */
    double z[3], w[3];
} row_sums;

/* Adds the gradients at X. */
TL_INLINE void pull_point(const tl_grad_view *view, const grad_triangle *t, const point_gradients *g, double x,
                          int has_db, row_sums *s)
{
    const double a[3] = {plane_at(t->q[0], x), plane_at(t->q[1], x), plane_at(t->q[2], x)};
    const double total = plane_at(t->sum, x), r = total == 0.0 ? 0.0 : 1.0 / total;
    const double u = a[0] * r, v = a[1] * r;
    double g_u = g->u, g_v = g->v, g_total = 0.0, g_a[3];
    const double u_in = clamped(u, 0.0, 1.0), v_in = clamped(v, 0.0, 1.0), sum = u_in + v_in;
    if (u != u_in || v != v_in || sum > 1.0) {
        const double scale = sum > 1.0 ? 1.0 / sum : 1.0;
        const double g_sum = sum > 1.0 ? (g_u * u_in + g_v * v_in) * scale * scale : 0.0;
        g_u = u == u_in ? g_u * scale - g_sum : 0.0, g_v = v == v_in ? g_v * scale - g_sum : 0.0;
    }
    for (int axis = 0; has_db && axis < 2; axis++) {
        const double step = 2.0 * view->scale[axis] * r, g_du = g->db[axis] * step, g_dv = g->db[2 + axis] * step;
        const double both = g_du * u + g_dv * v;
        s->q[0][axis] += g_du - both, s->q[1][axis] += g_dv - both, s->q[2][axis] -= both;
        g_u -= g_du * t->sum[axis], g_v -= g_dv * t->sum[axis];
        g_total -= (g_du * (t->q[0][axis] - u * t->sum[axis]) + g_dv * (t->q[1][axis] - v * t->sum[axis])) * r;
    }
    g_total -= (g_u * u + g_v * v) * r;
    g_a[0] = g_u * r + g_total, g_a[1] = g_v * r + g_total, g_a[2] = g_total;
    if (g->zw != 0.0) {
        const double under = t->w[0] * a[0] + t->w[1] * a[1] + t->w[2] * a[2];
        const double zw = (t->z[0] * a[0] + t->z[1] * a[1] + t->z[2] * a[2]) / (under == 0.0 ? 1.0 : under);
        const double g_over = under != 0.0 && fabs(zw) <= view->z_most ? g->zw / under : 0.0, g_under = -g_over * zw;
        for (int k = 0; k < 3 && g_over != 0.0; k++) {
            g_a[k] += g_over * t->z[k] + g_under * t->w[k];
            s->z[k] += g_over * a[k], s->w[k] += g_under * a[k];
        }
    }
    for (int k = 0; k < 3; k++)
        s->a[k] += g_a[k], s->a_x[k] += g_a[k] * x;
}

/* Adds what a run has summed up at Y, its X beginning `from` off the triangle's, to the triangle's sums. */
TL_INLINE void close_row(const row_sums *s, double from, double y, double *sums)
{
    for (int k = 0; k < 3; k++) {
        sums[2 + 3 * k] += s->a_x[k] + from * s->a[k] + s->q[k][0];
        sums[3 + 3 * k] += y * s->a[k] + s->q[k][1];
        sums[4 + 3 * k] += s->a[k];
        sums[11 + k] += s->z[k], sums[14 + k] += s->w[k];
    }
}

/* Gradients of the corners of a triangle from its sums: q_k = v_i x v_j. */
TL_INLINE void close_triangle(const tl_grad_view *view, int32_t id, const double *sums, tl_grad_sums *vertices,
                              int is_f64)
{
    grad_triangle t;
    double *to[3], g[3][3] = {{0}};
    load_seen_triangle(view, id, sums[0], sums[1], &t, is_f64);
    corner_sums(view, vertices, id, to);
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const double *d = sums + 2 + 3 * k;
        g[i][0] += t.y[j] * d[2] - t.w[j] * d[1], g[i][1] += t.w[j] * d[0] - t.x[j] * d[2];
        g[i][2] += t.x[j] * d[1] - t.y[j] * d[0];
        g[j][0] += d[1] * t.w[i] - d[2] * t.y[i], g[j][1] += d[2] * t.x[i] - d[0] * t.w[i];
        g[j][2] += d[0] * t.y[i] - d[1] * t.x[i];
    }
    for (int k = 0; k < 3; k++) {
        to[k][0] += g[k][0], to[k][1] += g[k][1], to[k][2] += sums[11 + k];
        to[k][3] += g[k][2] + sums[14 + k] - (sums[0] * g[k][0] + sums[1] * g[k][1]);
    }
}

TL_INLINE int64_t pull_points(const tl_grad_view *view, const tl_grad_points *p, int has_db, int is_f64)
{
    grad_triangle t;
    pixel_run run = before_shown(view);
    while (next_shown(view, p->rast, view->n_vertices, &run, is_f64)) {
        row_sums s;
        const double x = middle_at(view, 0, run.column), y = middle_at(view, 1, run.row);
        const int is_new = p->faces->slot_of[run.id] < 0;
        double *sums = sums_of(p->faces, run.id);
        memset(&s, 0, sizeof s);
        if (is_new)
            sums[0] = x, sums[1] = y;
        load_seen_triangle(view, run.id, x, y, &t, is_f64);
        for (int64_t i = 0; i < run.n; i++) {
            const int64_t at = 4 * (run.at + i);
            point_gradients g = {get_real(p->g_rast, at, is_f64),
                                 get_real(p->g_rast, at + 1, is_f64),
                                 get_real(p->g_rast, at + 2, is_f64),
                                 {0}};
            for (int c = 0; has_db && c < 4; c++)
                g.db[c] = get_real(p->g_db, at + c, is_f64);
            pull_point(view, &t, &g, 2.0 * view->scale[0] * (double)i, has_db, &s);
        }
        close_row(&s, x - sums[0], y - sums[1], sums);
    }
    for (int64_t i = 0; i < p->faces->n; i++)
        close_triangle(view, p->faces->rows[i], p->faces->sums + TL_SUMS_OF_FACE * i, p->vertices, is_f64);
    leave_band(p->faces);
    leave_band(p->vertices);
    return run.bad_id;
}

/* See kernels.h. */
static int64_t grad_points_vjp(const tl_grad_view *view, const tl_grad_points *p)
{
    if (view->is_f64)
        return p->g_db ? pull_points(view, p, 1, 1) : pull_points(view, p, 0, 1);
    return p->g_db ? pull_points(view, p, 1, 0) : pull_points(view, p, 0, 0);
}

#endif
