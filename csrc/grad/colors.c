/* Backward from colours of float32 to vertices and attributes in one pass, instead of values.c and then points.c,
 * without the gradient of `rast`.
 * In: faces, gradients of their pixels.  Out: sums by vertex, of positions and of attributes.
 *
 * With a_k and the total as in points.c, an attribute is P / total, P = sum A_k a_k; here A_k are less that of the last
 * corner.  So a triangle needs the sums of h = g / total and of h_total = -sum h P / total, as they are, times X and
 * times Y: gradients of A_k are those of h with q_k, and those of a_k are sum A_k h + h_total. */
#ifndef TL_GRAD_COLORS_C
#define TL_GRAD_COLORS_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "grad/faces.c"
#include "grad/grad.h"
#include "grad/pixels.h"
#include "grad/points.c"
#include "grad/values.c"
#include "lanes/lanes.h"
#include "lanes/quads.h"

/* Loads the gradients of n attributes at four pixels; n_columns numbers a pixel.  Lanes beyond n_pixels are undefined.
 * TL_VQ4_ROOM pixels can be read. */
TL_INLINE vq4 load_gradients(const float *g_out, int64_t n_pixels, int n, int64_t n_columns)
{
    float some[16] = {0};
    if (n == n_columns)
        return vq4_load(g_out, TL_VQ4_ROOM, n);
    for (int64_t k = 0; k < 4 && k < n_pixels; k++)
        memcpy(some + 4 * k, g_out + n_columns * k, (size_t)n * sizeof *some);
    return vq4_load(some, 4, 4);
}

/* Sums the gradients of n attributes at TL_SUMMED pixels of a run without clamped weights, or at its last n_pixels:
 * sums[0] plain, sums[1] times the number of the pixel. */
TL_INLINE void sum_up_pixels(const run_plane *plane, const float *g_out, int n_pixels, int n, int64_t n_columns,
                             vq4 sums[2])
{
    const vq4 zero = vq4_set1(0.0f);
    run_columns columns = columns_from(0);
    sums[0] = sums[1] = zero;
    for (int i = 0; i < TL_SUMMED && i < n_pixels; i += 4) {
        const vq4 at = plane_at_pixels(plane, &columns), inverse = inverse_at_pixels(plane, &columns);
        const vq4 g = vq4_mul(load_gradients(g_out + n_columns * i, n_pixels - i, n, n_columns), inverse);
        const vq4 of_total = vq4_sub(zero, vq4_sum(vq4_mul(g, vq4_mul(at, inverse))));
        const vq4 h = vq4_first(TL_VQ4_BLEND(g, of_total, 8), n_pixels - i);
        sums[0] = vq4_add(sums[0], h), sums[1] = vq4_add(sums[1], vq4_mul(h, columns.quads));
        next_columns(&columns);
    }
}

/* Adds the gradients of a run with clamped weights to its corners, in float64; `rast` and `out` of `values` are indexed
 * by the pixel in the picture. */
static void backward_clamped(const picture_pass *p, const tl_grad_values *values, const pixel_run *run)
{
    const tl_grad_view *view = p->view;
    const double x = middle_at(view, 0, run->column), y = middle_at(view, 1, run->row);
    double sums[FACE_X + 12] = {0}, *to[3];
    int64_t rows[3];
    grad_triangle t;
    row_sums s;
    memset(&s, 0, sizeof s);
    load_seen_triangle(view, run->id, x, y, &t, 0);
    attr_rows(view, run->id, values->n_columns, rows);
    for (int k = 0; k < 3; k++)
        to[k] = sums_of(p->l->vertices, view->tri[3 * (int64_t)run->id + k]) + TL_FEW_COLUMNS;
    for (int64_t i = 0; i < run->n; i++) {
        const float *rast = (const float *)values->rast + 4 * (run->at + i);
        point_gradients g_point = {0};
        for (int64_t c = 0; c < values->n_columns; c++) {
            const double g = get_real(values->out, values->n_columns * (run->at + i) + c, 0);
            double step[2];
            attr_steps(values, rows, c, step, 0);
            g_point.u += g * step[0], g_point.v += g * step[1];
            add_to_corners(to, c, g * (double)rast[0], g * (double)rast[1], g);
        }
        backward_point(view, &t, &g_point, 2.0 * view->scale[0] * (double)i, 0, &s);
    }
    add_row_sums(s.a, s.a_x, x, y, sums);
    finish_triangle(view, run->id, sums, p->l->vertices, 0);
}

/* TL_LANES faces from `first` on, of which n exist. */
typedef struct {
    int64_t first;
    int n;
    int32_t from[TL_MAX_LANES];       /* 0, 1, 2 and so on; 0 beyond n */
    int32_t corners[3][TL_MAX_LANES]; /* lanes beyond n have corners, too */
    vd v[3][3], q[3][3], units[3];
} face_lanes;

/* Loads the triangles of faces; x0 and y0: the centres of their first pixels. */
TL_INLINE void load_faces(const picture_pass *p, face_lanes *l, vd *x0, vd *y0)
{
    const int32_t *const corners[3] = {l->corners[0], l->corners[1], l->corners[2]};
    vd z[3];
    for (int i = 0; i < TL_LANES; i++)
        l->from[i] = i < l->n ? i : 0;
    for (int k = 0; k < 3; k++)
        vi_store(l->corners[k], vi_load(p->corners[k] + l->first));
    *x0 = middles_at(p->view, 0, vi_load(p->column + l->first));
    *y0 = middles_at(p->view, 1, vi_load(p->row + l->first));
    load_triangles(p->view, corners, *x0, *y0, l->v, l->q, z);
    const vd total = sum_of_three(l->q[0][2], l->q[1][2], l->q[2][2]);
    l->units[2] = vd_div(vd_set1(1.0), one_for_zero(total));
    for (int c = 0; c < 2; c++)
        l->units[c] = vd_mul(vd_set1(2.0 * p->view->scale[c]), l->units[2]);
}

/* Adds four columns of n lanes to the rows of their corners, triangle by triangle, from column `first` on. */
TL_INLINE void add_rows(int n, double *const rows[3][TL_MAX_LANES], int64_t first, vd columns[3][4])
{
    double some[3][4 * TL_MAX_LANES];
    for (int k = 0; k < 3; k++)
        vd_store_quads(some[k], 4, columns[k]);
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) {
            double *to = rows[k][i] + first;
            vqd_store(to, vqd_add(vqd_load(to), vqd_load(some[k] + 4 * i)));
        }
}
/* Adds the gradients of the attributes to the corners' sums; adds the gradients of q_k to by_q. */
TL_INLINE void finish_attributes(const picture_pass *p, const face_lanes *l, double *const to[3][TL_MAX_LANES],
                                 vd by_q[3][3])
{
    const int64_t n = p->l->n_columns;
    for (int64_t first = 0; first < n; first += 3) {
        const double *moments = face_at(p, l->first) + place_of_three(first) + THREE_SUMS;
        vd m[12], at[3][3], found[3][4];
        for (int j = 0; j < 12; j += 4)
            vd_load_records(moments + j, (int)p->l->faces->n_columns, l->from, m + j);
        for (int j = 0; j < 12; j++)
            m[j] = vd_mul(m[j], l->units[j / 4]);
        for (int k = 0; k < 3; k++) {
            load_attributes(p->l->attr, n, first, l->corners[k], at[k]);
            for (int c = 0; c < 3; c++)
                found[k][c] =
                    sum_of_three(vd_mul(l->q[k][0], m[c]), vd_mul(l->q[k][1], m[4 + c]), vd_mul(l->q[k][2], m[8 + c]));
            found[k][3] = vd_set1(0.0);
        }
        add_rows(l->n, to, TL_FEW_COLUMNS + first, found);
        for (int j = 0; j < 3; j++)
            for (int c = 0; c < 3; c++) {
                by_q[0][j] = vd_add(by_q[0][j], vd_mul(vd_sub(at[0][c], at[2][c]), m[4 * j + c]));
                by_q[1][j] = vd_add(by_q[1][j], vd_mul(vd_sub(at[1][c], at[2][c]), m[4 * j + c]));
                for (int k = 0; k < 3 && c == 0; k++)
                    by_q[k][j] = vd_add(by_q[k][j], m[4 * j + 3]);
            }
    }
}

/* Adds the gradients of the corners of faces and of their attributes, computed from the sums of the faces; see
 * `backward_corners`. */
static void finish_triangles(const picture_pass *p, face_lanes *l)
{
    vd x0, y0, by_q[3][3], g[3][4];
    double *to[3][TL_MAX_LANES];
    load_faces(p, l, &x0, &y0);
    for (int k = 0; k < 9; k++)
        by_q[k / 3][k % 3] = g[k / 3][k % 3] = vd_set1(0.0);
    for (int i = 0; i < l->n; i++)
        for (int k = 0; k < 3; k++)
            to[k][i] = sums_of(p->l->vertices, l->corners[k][i]);
    finish_attributes(p, l, to, by_q);
    for (int k = 0; k < 3; k++) { /* q_k = v_i x v_j */
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        for (int a = 0; a < 3; a++) {
            const int b = (a + 1) % 3, c = (a + 2) % 3;
            g[i][a] = vd_add(g[i][a], vd_sub(vd_mul(l->v[j][b], by_q[k][c]), vd_mul(l->v[j][c], by_q[k][b])));
            g[j][a] = vd_add(g[j][a], vd_sub(vd_mul(l->v[i][c], by_q[k][b]), vd_mul(l->v[i][b], by_q[k][c])));
        }
    }
    for (int k = 0; k < 3; k++) { /* z has no gradient */
        g[k][3] = vd_sub(g[k][2], vd_add(vd_mul(x0, g[k][0]), vd_mul(y0, g[k][1])));
        g[k][2] = vd_set1(0.0);
    }
    add_rows(l->n, to, 0, g);
}

/* Finishes a band: adds the sums of faces to the sums of their corners. */
static void finish_faces(const picture_pass *p)
{
    const int64_t n_faces = p->l->faces->n;
    for (int64_t i = 0; i < n_faces; i += TL_LANES) {
        face_lanes l = {.first = i, .n = (int)(n_faces - i < TL_LANES ? n_faces - i : TL_LANES)};
        finish_triangles(p, &l);
    }
    reset_band(p->l->faces);
    flush_band(p->l->vertices);
}

#endif
