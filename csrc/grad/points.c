/* Weights of the corners at each pixel, z/w, and their derivatives; and backward, from their gradients to sums of
 * gradients by vertex.
 * In: ids of a picture.  Out: `rast`, `rast_db`; backward: sums of x, y, z, w.
 *
 * X, Y: the centre of a pixel minus (X0, Y0), the centre of the first pixel that shows the triangle; x' = x - X0 w, y'
 * = y - Y0 w of its corners.  Then a_k = q_k . (X, Y, 1) with q_k the cross product of the other two corners (x', y',
 * w), and the weights are a_k / (a_0 + a_1 + a_2).  So backward needs the sums over a triangle of the gradients of a_k
 * times X, Y and 1; the gradients of its corners follow from them.  Derivatives of weights need only the first two
 * numbers of q_k.
 *
 * Based on: Laine, S. et al., "Modular Primitives for High-Performance Differentiable Rendering", 2020, section 3. */
#ifndef TL_GRAD_POINTS_C
#define TL_GRAD_POINTS_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "grad/grad.h"
#include "grad/pixels.h"
#include "grad/spans.h"
#include "lanes/lanes.h"
#include "lanes/quads.h"

/* A triangle relative to the centre of a pixel. */
typedef struct {
    double x[3], y[3], z[3], w[3];
    double q[3][3]; /* q[k]: by X, by Y, and at the centre */
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

/* A linear function of X and Y at X in the row of the centre. */
TL_INLINE double plane_at(const double *q, double x) { return q[0] * x + q[2]; }

/* Writes pixel i of a run, at X from the first pixel: weights are clamped to a sum of at most 1, z/w to z_most. */
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

static void points_of_ids(const tl_grad_view *view, const id_rows *ids, void *const *out)
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
            load_seen_triangle(view, run.id, middle_at(view, 0, run.column), y, &t, 1);
            for (int64_t i = 0; i < run.n; i++)
                store_point(view, &t, &run, i, 2.0 * view->scale[0] * (double)i, out, 1);
        }
    }
}

/* Numbers of runs, relative to their first pixel and in units of its total: u and v times the total there, their
 * derivatives by column and by row, those of the total, and z/w. */
enum {
    POINT_U,
    POINT_U_X,
    POINT_U_Y,
    POINT_V,
    POINT_V_X,
    POINT_V_Y,
    POINT_TOTAL_X,
    POINT_TOTAL_Y,
    POINT_ZW,
    POINT_ZW_X
};

/* The centres of columns or rows. */
TL_INLINE vd middles_at(const tl_grad_view *view, int axis, vi i)
{
    const vd middle = vd_add(vd_mul(vd_set1(2.0), vd_from_vi(i)), vd_set1(1.0));
    return vd_add(vd_mul(middle, vd_set1(view->scale[axis])), vd_set1(view->shift[axis]));
}

/* Loads n <= 3 attributes of float32 of rows, from `first` on, as columns; other columns are 0. */
TL_INLINE void load_attributes(const float *attr, int64_t n_columns, int64_t first, const int32_t *rows, vd *columns)
{
    const vi at = vi_mul(vi_load(rows), vi_set1((int32_t)n_columns));
    for (int c = 0; c < 3; c++)
        columns[c] = first + c < n_columns
                         ? vd_from_vf(vf_of_bits(vi_gather(vm_all(), (const int32_t *)attr + first + c, at)))
                         : vd_set1(0.0);
}

/* Loads corners v_k = x', y', w of TL_LANES triangles relative to x0, y0, q_k as in `load_seen_triangle`, and z. */
TL_INLINE void load_triangles(const tl_grad_view *view, const int32_t *const corners[3], vd x0, vd y0, vd v[3][3],
                              vd q[3][3], vd *z)
{
    for (int k = 0; k < 3; k++) {
        vi bits[4];
        vi_load_records(view->pos, 16, corners[k], bits);
        z[k] = vd_from_vf(vf_of_bits(bits[2])), v[k][2] = vd_from_vf(vf_of_bits(bits[3]));
        v[k][0] = vd_sub(vd_from_vf(vf_of_bits(bits[0])), vd_mul(x0, v[k][2]));
        v[k][1] = vd_sub(vd_from_vf(vf_of_bits(bits[1])), vd_mul(y0, v[k][2]));
    }
    for (int k = 0; k < 3; k++) {
        const vd *a = v[(k + 1) % 3], *b = v[(k + 2) % 3];
        q[k][0] = vd_sub(vd_mul(a[1], b[2]), vd_mul(a[2], b[1]));
        q[k][1] = vd_sub(vd_mul(a[2], b[0]), vd_mul(a[0], b[2]));
        q[k][2] = vd_sub(vd_mul(a[0], b[1]), vd_mul(a[1], b[0]));
    }
}

TL_INLINE vd sum_of_three(vd a, vd b, vd c) { return vd_add(vd_add(a, b), c); }
TL_INLINE vd one_for_zero(vd a)
{
    const vd zero = vd_set1(0.0);
    return vd_select(vm_and(vd_ge(a, zero), vd_ge(zero, a)), vd_set1(1.0), a);
}

/* Stores a number of runs, 0 for background. */
TL_INLINE void set_number(grad_span *s, int r, int number, vm m, vd value)
{
    vf_store(s->numbers[number] + r, vf_select(m, vf_from_vd(value), vf_set1(0.0f)));
}

/* Sets the numbers of runs; `inverses`: 1 / total, or NULL. */
TL_INLINE void set_point_numbers(const tl_grad_view *view, grad_span *s, double *inverses)
{
    const vd step[2] = {vd_set1(2.0 * view->scale[0]), vd_set1(2.0 * view->scale[1])};
    for (int r = 0; r < s->n_runs; r += TL_LANES) {
        const vm m = vm_and(vm_first(s->n_runs - r), vi_gt(vi_load(s->ids + r), vi_set1(-1)));
        vd v[3][3], q[3][3], z[3], sum[3], products[3];
        if (!vm_any(m)) {
            for (int k = 0; k <= POINT_ZW_X; k++)
                vf_store(s->numbers[k] + r, vf_set1(0.0f));
            continue;
        }
        const int32_t *const corners[3] = {s->corners[0] + r, s->corners[1] + r, s->corners[2] + r};
        const vd x0 = middles_at(view, 0, vi_add(vi_load(s->begins + r), vi_set1((int32_t)s->first)));
        load_triangles(view, corners, x0, vd_set1(middle_at(view, 1, s->row)), v, q, z);
        for (int c = 0; c < 3; c++)
            sum[c] = sum_of_three(q[0][c], q[1][c], q[2][c]);
        const vd inverse = vd_div(vd_set1(1.0), one_for_zero(sum[2]));
        if (inverses)
            vd_store(inverses + r, inverse);
        for (int k = 0; k < 2; k++) {
            set_number(s, r, 3 * k + POINT_U, m, vd_mul(q[k][2], inverse));
            for (int axis = 0; axis < 2; axis++)
                set_number(s, r, 3 * k + POINT_U_X + axis, m, vd_mul(vd_mul(q[k][axis], step[axis]), inverse));
            set_number(s, r, POINT_TOTAL_X + k, m, vd_mul(vd_mul(sum[k], step[k]), inverse));
        }
        for (int k = 0; k < 3; k++)
            products[k] = vd_mul(v[k][2], q[k][2]);
        const vd under = one_for_zero(sum_of_three(products[0], products[1], products[2]));
        for (int c = 0; c < 3; c += 2) {
            for (int k = 0; k < 3; k++)
                products[k] = vd_mul(z[k], q[k][c]);
            const vd over = sum_of_three(products[0], products[1], products[2]);
            set_number(s, r, c ? POINT_ZW : POINT_ZW_X, m, vd_div(c ? over : vd_mul(over, step[0]), under));
        }
    }
}

/* Weights and z/w of TL_LANES pixels. */
typedef struct {
    vf x, inverse, u, v, zw; /* inverse: of the total */
} lane_points;

TL_INLINE lane_points points_of_lanes(const span_lanes *p)
{
    lane_points at = {.x = from_begin(p)};
    const vf one = vf_set1(1.0f), total = vf_fma(pick_number(p, POINT_TOTAL_X), at.x, one);
    at.inverse = vf_div(one, total);
    at.u = vf_mul(vf_fma(pick_number(p, POINT_U_X), at.x, pick_number(p, POINT_U)), at.inverse);
    at.v = vf_mul(vf_fma(pick_number(p, POINT_V_X), at.x, pick_number(p, POINT_V)), at.inverse);
    at.zw = vf_fma(pick_number(p, POINT_ZW_X), at.x, pick_number(p, POINT_ZW));
    return at;
}

TL_INLINE vf within(vf a, float most) { return vf_min(vf_max(a, vf_set1(-most)), vf_set1(most)); }
TL_INLINE vf within_one(vf a) { return vf_min(vf_max(a, vf_set1(0.0f)), vf_set1(1.0f)); }

/* Writes the derivatives of the weights of pixels. */
TL_INLINE void store_slopes(const span_lanes *p, const lane_points *at, float *out)
{
    vf slopes[4];
    for (int k = 0; k < 4; k++) {
        const vf change = vf_mul(k < 2 ? at->u : at->v, pick_number(p, POINT_TOTAL_X + k % 2));
        const vf slope = vf_mul(vf_sub(pick_number(p, k / 2 * 3 + POINT_U_X + k % 2), change), at->inverse);
        slopes[k] = vf_select(p->is_shown, slope, vf_set1(0.0f));
    }
    store_some_quads(out + 4 * p->x, p->n, slopes);
}

/* Writes `rast` and, unless it is NULL, `rast_db` of a span. */
TL_INLINE void points_of_span(const tl_grad_view *view, const grad_span *s, float *rast, float *rast_db)
{
    const vi order = order_of_quads(), last = vi_set1(TL_LAST_EXACT_ID);
    const vf zero = vf_set1(0.0f);
    for (int i = 0; i * TL_LANES < s->n; i++) {
        const span_lanes p = lanes_of_span(s, i, order, 1);
        const lane_points at = points_of_lanes(&p);
        vf out[4] = {within_one(at.u), within_one(at.v), within(at.zw, (float)view->z_most), zero};
        const vf sum = vf_add(out[0], out[1]);
        if (vm_any(vf_lt(vf_set1(1.0f), sum))) {
            const vf divisor = vf_max(sum, vf_set1(1.0f));
            out[0] = vf_div(out[0], divisor), out[1] = vf_div(out[1], divisor);
        }
        const vi id = vi_add(vi_pick(s->ids + p.first, p.run), vi_set1(1));
        const vf large = vf_of_bits(vi_add(id, vi_set1(TL_BITS_OF_LAST - TL_LAST_EXACT_ID)));
        out[3] = vf_select(vi_gt(id, last), large, vf_from_vi(id));
        for (int k = 0; k < 4; k++)
            out[k] = vf_select(p.is_shown, out[k], zero);
        store_some_quads(rast + 4 * p.x, p.n, out);
        if (rast_db)
            store_slopes(&p, &at, rast_db);
    }
}

static void points_in_lanes(const tl_grad_view *view, const id_rows *ids, float *rast, float *rast_db)
{
    grad_span s = TL_BEFORE_SPANS(view);
    while (next_grad_span(view, ids, view->n_vertices, &s)) {
        const int64_t at = 4 * (s.row * view->width + s.first);
        set_point_numbers(view, &s, 0);
        points_of_span(view, &s, rast + at, rast_db ? rast_db + at : 0);
    }
}

/* See kernels.h. */
static void grad_points(const tl_grad_view *view, const int32_t *ids, int64_t step, int64_t first_id, void *rast,
                        void *rast_db)
{
    const id_rows rows = {ids, step, first_id, 0};
    void *const out[2] = {rast, rast_db};
    if (view->is_f64)
        points_of_ids(view, &rows, out);
    else
        points_in_lanes(view, &rows, rast, rast_db);
}

/* Gradients at a pixel, of `rast` and of `rast_db`. */
typedef struct {
    double u, v, zw, db[4];
} point_gradients;

#define TL_ALMOST_ONE (1.0f - 0x1p-20f) /* float32 weights with a smaller sum are not clamped */
#define TL_TIE 0x1p-30                  /* weights so little outside are on an edge, but for rounding */

/* The sums over a row of pixels. */
typedef struct {
    double a[4], a_x[4]; /* gradients of a_k and of z/w: their sums, and times X */
    double q[2][3];      /* gradients of the first two numbers of q_k alone */
} row_sums;

/* The sums of a triangle: X0 and Y0 with FACE_BEGUN, times X, times Y, and plain. */
enum { FACE_BEGUN = 2, FACE_X = 4, FACE_Y = 8, FACE_ONE = 12 };

/* Adds the gradients of a pixel at X. */
TL_INLINE void backward_point(const tl_grad_view *view, const grad_triangle *t, const point_gradients *g, double x,
                              int has_db, row_sums *s)
{
    const double a[3] = {plane_at(t->q[0], x), plane_at(t->q[1], x), plane_at(t->q[2], x)};
    const double total = plane_at(t->sum, x), r = total == 0.0 ? 0.0 : 1.0 / total;
    const double u = a[0] * r, v = a[1] * r;
    double g_u = g->u, g_v = g->v, g_total = 0.0, g_a[4] = {0};
    const double u_in = clamped(u, 0.0, 1.0), v_in = clamped(v, 0.0, 1.0), sum = u_in + v_in;
    const int has_u = fabs(u - u_in) <= TL_TIE, has_v = fabs(v - v_in) <= TL_TIE, is_over = sum > 1.0 + TL_TIE;
    if (!has_u || !has_v || is_over) {
        const double scale = is_over ? 1.0 / sum : 1.0;
        const double g_sum = is_over ? (g_u * u_in + g_v * v_in) * scale * scale : 0.0;
        g_u = has_u ? g_u * scale - g_sum : 0.0, g_v = has_v ? g_v * scale - g_sum : 0.0;
    }
    for (int axis = 0; has_db && axis < 2; axis++) {
        const double step = 2.0 * view->scale[axis] * r, g_du = g->db[axis] * step, g_dv = g->db[2 + axis] * step;
        const double both = g_du * u + g_dv * v;
        s->q[axis][0] += g_du - both, s->q[axis][1] += g_dv - both, s->q[axis][2] -= both;
        g_u -= g_du * t->sum[axis], g_v -= g_dv * t->sum[axis];
        g_total -= (g_du * (t->q[0][axis] - u * t->sum[axis]) + g_dv * (t->q[1][axis] - v * t->sum[axis])) * r;
    }
    g_total -= (g_u * u + g_v * v) * r;
    g_a[0] = g_u * r + g_total, g_a[1] = g_v * r + g_total, g_a[2] = g_total;
    if (g->zw != 0.0) {
        const double under = t->w[0] * a[0] + t->w[1] * a[1] + t->w[2] * a[2];
        const double zw = (t->z[0] * a[0] + t->z[1] * a[1] + t->z[2] * a[2]) / (under == 0.0 ? 1.0 : under);
        g_a[3] = under != 0.0 && fabs(zw) <= view->z_most ? g->zw : 0.0;
    }
    for (int k = 0; k < 4; k++)
        s->a[k] += g_a[k], s->a_x[k] += g_a[k] * x;
}

/* Adds the sums of a run that begins at x, y to the sums of its triangle: gradients of a_k, and times X. */
TL_INLINE void add_row_sums(const double *a, const double *a_x, double x, double y, double *sums)
{
    if (sums[FACE_BEGUN] == 0.0)
        sums[0] = x, sums[1] = y, sums[FACE_BEGUN] = 1.0;
    x -= sums[0], y -= sums[1];
    for (int k = 0; k < 4; k++)
        sums[FACE_X + k] += a_x[k] + x * a[k];
    for (int k = 0; k < 4; k++)
        sums[FACE_Y + k] += y * a[k];
    for (int k = 0; k < 4; k++)
        sums[FACE_ONE + k] += a[k];
}

/* Gradients of q_k, of z_k and of w_k, from the sums of a triangle.  z/w is sum z_k a_k / D; D = sum w_k a_k, the
 * determinant of the corners, is equal at every pixel. */
TL_INLINE void backward_depth(const grad_triangle *t, const double *sums, double by_q[3][3], double *g_z, double *g_w)
{
    const double moments[3] = {sums[FACE_X + 3], sums[FACE_Y + 3], sums[FACE_ONE + 3]};
    double under = 0.0, g_under = 0.0;
    for (int k = 0; k < 3; k++) {
        for (int c = 0; c < 3; c++)
            by_q[k][c] = sums[FACE_X + 4 * c + k];
        under += t->w[k] * t->q[k][2], g_z[k] = g_w[k] = 0.0;
    }
    if (under == 0.0 || (moments[0] == 0.0 && moments[1] == 0.0 && moments[2] == 0.0))
        return;
    for (int k = 0; k < 3; k++) {
        for (int c = 0; c < 3; c++) {
            g_z[k] += t->q[k][c] * moments[c] / under;
            by_q[k][c] += t->z[k] * moments[c] / under;
        }
        g_under -= t->z[k] * g_z[k] / under;
    }
    for (int k = 0; k < 3; k++) {
        by_q[k][2] += g_under * t->w[k];
        g_w[k] = g_under * t->q[k][2];
    }
}

/* Adds the gradients of the corners of a triangle, from the gradients of q_k = v_i x v_j relative to x, y, of z_k and
 * of w_k. */
TL_INLINE void backward_corners(const grad_triangle *t, double by_q[3][3], double x, double y, const double *g_z,
                                const double *g_w, double **to)
{
    double g[3][3] = {{0}};
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const double *d = by_q[k];
        g[i][0] += t->y[j] * d[2] - t->w[j] * d[1], g[i][1] += t->w[j] * d[0] - t->x[j] * d[2];
        g[i][2] += t->x[j] * d[1] - t->y[j] * d[0];
        g[j][0] += d[1] * t->w[i] - d[2] * t->y[i], g[j][1] += d[2] * t->x[i] - d[0] * t->w[i];
        g[j][2] += d[0] * t->y[i] - d[1] * t->x[i];
    }
    for (int k = 0; k < 3; k++) {
        to[k][0] += g[k][0], to[k][1] += g[k][1], to[k][2] += g_z[k];
        to[k][3] += g[k][2] + g_w[k] - (x * g[k][0] + y * g[k][1]);
    }
}

/* Adds the gradients of the corners of a triangle, computed from its sums. */
static void finish_triangle(const tl_grad_view *view, int32_t id, const double *sums, tl_grad_sums *vertices,
                            int is_f64)
{
    grad_triangle t;
    double *to[3], by_q[3][3], g_z[3], g_w[3];
    load_seen_triangle(view, id, sums[0], sums[1], &t, is_f64);
    corner_sums(view, vertices, id, to);
    backward_depth(&t, sums, by_q, g_z, g_w);
    backward_corners(&t, by_q, sums[0], sums[1], g_z, g_w, to);
}

/* The sums of the triangle of a run; new sums are relative to its first pixel. */
TL_INLINE double *sums_for(const tl_grad_view *view, tl_grad_sums *faces, const grad_span *s, int r)
{
    double *sums = sums_of(faces, s->ids[r]);
    if (sums[FACE_BEGUN] == 0.0) {
        sums[0] = middle_at(view, 0, s->first + s->begins[r]), sums[1] = middle_at(view, 1, s->row);
        sums[FACE_BEGUN] = 1.0;
    }
    return sums;
}

/* Adds sums relative to x, y: times X, times Y, and plain. */
TL_INLINE void add_three_moments(double *moments, vqd whole, vqd by_x, double x, double y)
{
    vqd_store(moments, vqd_add(vqd_load(moments), vqd_add(by_x, vqd_mul(whole, vqd_set1(x)))));
    vqd_store(moments + 4, vqd_add(vqd_load(moments + 4), vqd_mul(whole, vqd_set1(y))));
    vqd_store(moments + 8, vqd_add(vqd_load(moments + 8), whole));
}

/* Adds the sums over pixels of a run, plain and times their number, in units of the total at the run's first pixel;
 * `last`: the unit of the fourth number. */
TL_INLINE void add_moments(const tl_grad_view *view, const grad_span *s, int r, int first, double last,
                           const double *begins, double *moments, vq4 sum, vq4 sum_x)
{
    const double inverse = s->inverses[r], step = 2.0 * view->scale[0];
    const double x = middle_at(view, 0, s->first + s->begins[r] + first) - begins[0];
    const double y = middle_at(view, 1, s->row) - begins[1];
    const vqd unit = vqd_load((const double[]){inverse, inverse, inverse, last});
    const vqd by_x = vqd_mul(vqd_from_vq(vq4_fold(sum_x)), unit);
    add_three_moments(moments, vqd_mul(vqd_from_vq(vq4_fold(sum)), unit), vqd_mul(by_x, vqd_set1(step)), x, y);
}

/* Sets the quads of runs: u, v, z/w and the total. */
TL_INLINE void set_point_quads(grad_span *s)
{
    for (int r = 0; r < s->n_runs; r += TL_LANES) {
        const vf begin[4] = {vf_load(s->numbers[POINT_U] + r), vf_load(s->numbers[POINT_V] + r),
                             vf_load(s->numbers[POINT_ZW] + r), vf_set1(1.0f)};
        const vf step[4] = {vf_load(s->numbers[POINT_U_X] + r), vf_load(s->numbers[POINT_V_X] + r),
                            vf_load(s->numbers[POINT_ZW_X] + r), vf_load(s->numbers[POINT_TOTAL_X] + r)};
        set_quads(s, 0, r, begin), set_quads(s, 1, r, step);
    }
}

/* Whether weights and z/w of a pixel lie well within their limits. */
TL_INLINE int is_unclamped(const float *rast, float z_most)
{
    return rast[0] > 0.0f && rast[1] > 0.0f && rast[0] + rast[1] < TL_ALMOST_ONE && rast[2] < z_most &&
           rast[2] > -z_most;
}

/* Adds the gradients at the pixels of a run without clamped weights. */
TL_INLINE void backward_run_of_points(const tl_grad_view *view, const grad_span *s, int r, const float *g_rast,
                                      double *sums)
{
    const run_plane plane = plane_of_run(s, r);
    const vq4 zero = vq4_set1(0.0f);
    const int n = s->begins[r + 1] - s->begins[r];
    for (int first = 0; first < n; first += TL_SUMMED) {
        vq4 sum = zero, sum_x = zero;
        run_columns columns = columns_from(first), summed = columns_from(0);
        for (int i = 0; i < TL_SUMMED && first + i < n; i += 4) {
            const vq4 at = plane_at_pixels(&plane, &columns), inverse = inverse_at_pixels(&plane, &columns);
            const vq4 g = vq4_load(g_rast + 4 * (first + i), n - first - i, 4);
            const vq4 product = vq4_mul(g, vq4_mul(at, inverse));
            const vq4 total = vq4_add(TL_VQ4_PERMUTE(product, 0, 0, 0, 0), TL_VQ4_PERMUTE(product, 1, 1, 1, 1));
            const vq4 of_a = vq4_mul(vq4_sub(TL_VQ4_BLEND(g, zero, 12), total), inverse);
            const vq4 h = vq4_first(TL_VQ4_BLEND(of_a, TL_VQ4_PERMUTE(g, 2, 2, 2, 2), 8), n - first - i);
            sum = vq4_add(sum, h), sum_x = vq4_add(sum_x, vq4_mul(h, summed.quads));
            next_columns(&columns), next_columns(&summed);
        }
        add_moments(view, s, r, first, 1.0, sums, sums + FACE_X, sum, sum_x);
    }
}

/* Adds the gradients at the pixels of a run in float64. */
TL_INLINE void backward_points_of(const tl_grad_view *view, const tl_grad_points *p, const pixel_run *run, int has_db,
                                  int is_f64)
{
    grad_triangle t;
    row_sums s;
    const double x = middle_at(view, 0, run->column), y = middle_at(view, 1, run->row);
    memset(&s, 0, sizeof s);
    load_seen_triangle(view, run->id, x, y, &t, is_f64);
    for (int64_t i = 0; i < run->n; i++) {
        const int64_t at = 4 * (run->at + i);
        point_gradients g = {get_real(p->g_rast, at, is_f64),
                             get_real(p->g_rast, at + 1, is_f64),
                             get_real(p->g_rast, at + 2, is_f64),
                             {0}};
        for (int c = 0; has_db && c < 4; c++)
            g.db[c] = get_real(p->g_db, at + c, is_f64);
        backward_point(view, &t, &g, 2.0 * view->scale[0] * (double)i, has_db, &s);
    }
    double *sums = sums_of(p->faces, run->id);
    add_row_sums(s.a, s.a_x, x, y, sums);
    for (int k = 0; k < 3; k++)
        sums[FACE_X + k] += s.q[0][k], sums[FACE_Y + k] += s.q[1][k];
}

static int64_t backward_points_in_lanes(const tl_grad_view *view, const tl_grad_points *p)
{
    grad_span s = TL_BEFORE_SPANS(view);
    while (next_grad_span(view, &(id_rows){.rast = p->rast}, view->n_vertices, &s)) {
        set_point_numbers(view, &s, s.inverses);
        set_point_quads(&s);
        for (int r = 0; r < s.n_runs; r++) {
            const pixel_run run = run_of_span(view, &s, r);
            const float *rast = (const float *)p->rast + 4 * run.at, z_most = (float)view->z_most;
            if (run.id < 0)
                continue;
            if (is_unclamped(rast, z_most) && is_unclamped(rast + 4 * (run.n - 1), z_most))
                backward_run_of_points(view, &s, r, (const float *)p->g_rast + 4 * run.at,
                                       sums_for(view, p->faces, &s, r));
            else
                backward_points_of(view, p, &run, 0, 0);
        }
    }
    return s.bad_id;
}

TL_INLINE int64_t backward_points(const tl_grad_view *view, const tl_grad_points *p, int has_db, int is_f64)
{
    pixel_run run = before_shown(view);
    while (next_shown(view, p->rast, view->n_vertices, &run, is_f64))
        backward_points_of(view, p, &run, has_db, is_f64);
    return run.bad_id;
}

static int64_t backward_point_rows(const tl_grad_view *view, const tl_grad_points *p)
{
    if (view->is_f64)
        return backward_points(view, p, p->g_db != 0, 1);
    return p->g_db ? backward_points(view, p, 1, 0) : backward_points_in_lanes(view, p);
}

/* Finishes a band: adds the sums of triangles to those of their corners. */
static void finish_points(const tl_grad_view *view, const tl_grad_points *p)
{
    for (int64_t i = 0; i < p->faces->n; i++)
        finish_triangle(view, p->faces->rows[i], p->faces->sums + p->faces->n_columns * i, p->vertices, view->is_f64);
    flush_band(p->vertices);
}

/* See kernels.h. */
static int64_t grad_points_vjp(const tl_grad_view *view, const tl_grad_points *p)
{
    const int64_t bad_id = backward_point_rows(view, p);
    finish_points(view, p);
    reset_band(p->faces);
    return bad_id;
}

#endif
