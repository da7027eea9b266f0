/* Attributes of float32 at pixels backward, at once to vertices and attributes: what values.c and points.c give one
 * after the other, in one pass over the pixels, without the gradient of `rast`.
 * In: `rast`, attributes, gradients of their picture.  Out: sums by vertex, sums by row of attributes.
 *
 * With a_k and the total as in points.c, an attribute is P / total, P = sum A_k a_k; here A_k are less that of the last
 * corner.  So a triangle needs the sums of h = g / total and of h_total = -sum h P / total, as they are, times X and
 * times Y: gradients of A_k are those of h with q_k, and those of a_k are sum A_k h + h_total. */
#ifndef TL_GRAD_COLORS_C
#define TL_GRAD_COLORS_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "grad/pixels.h"
#include "grad/points.c"
#include "grad/spans.h"
#include "grad/values.c"
#include "lanes/lanes.h"
#include "lanes/quads.h"

/* Where the sums of three attributes from `first` on stand: twelve. */
TL_INLINE int64_t sums_of_three(int64_t first) { return FACE_X + first / 3 * TL_SUMS_OF_THREE; }

/* Sets the quads of runs: planes of n attributes from `first` on, at most three, and the total. */
TL_INLINE void set_color_quads(grad_span *s, const tl_grad_values *v, int64_t first, int n)
{
    const vf zero = vf_set1(0.0f);
    for (int r = 0; r < s->n_runs; r += TL_LANES) {
        const vm m = vm_and(vm_first(s->n_runs - r), vi_gt(vi_load(s->ids + r), vi_set1(-1)));
        vf begin[4] = {zero, zero, zero, vf_set1(1.0f)},
           step[4] = {zero, zero, zero, vf_load(s->numbers[POINT_TOTAL_X] + r)};
        for (int c = 0; c < n; c++) {
            vf at[3];
            for (int k = 0; k < 3; k++) {
                const vi row = vi_mul(vi_load(s->corners[k] + r), vi_set1((int32_t)v->n_columns));
                at[k] = vf_of_bits(vi_gather(m, (const int32_t *)v->attr + first + c, row));
            }
            const vf by_u = vf_sub(at[0], at[2]), by_v = vf_sub(at[1], at[2]);
            begin[c] =
                vf_add(vf_mul(by_u, vf_load(s->numbers[POINT_U] + r)), vf_mul(by_v, vf_load(s->numbers[POINT_V] + r)));
            step[c] = vf_add(vf_mul(by_u, vf_load(s->numbers[POINT_U_X] + r)),
                             vf_mul(by_v, vf_load(s->numbers[POINT_V_X] + r)));
        }
        set_quads(s, 0, r, begin), set_quads(s, 1, r, step);
    }
}

/* Gradients of n attributes, n_columns numbers a pixel, at four pixels; zeros, or anything, beyond the n_pixels. */
TL_INLINE vq4 load_gradients(const float *g_out, int64_t n_pixels, int n, int64_t n_columns, int has_room)
{
    float some[16] = {0};
    if (n == n_columns)
        return vq4_load(g_out, has_room ? TL_VQ4_ROOM : n_pixels, n);
    for (int64_t k = 0; k < 4 && k < n_pixels; k++)
        memcpy(some + 4 * k, g_out + n_columns * k, (size_t)n * sizeof *some);
    return vq4_load(some, 4, 4);
}

/* Sums up the gradients of n attributes at TL_SUMMED of the n_pixels that are left of a run, none of which is clamped:
 * as they are, and times the number of the pixel; `from` the beginning of the plane on.  has_room: five pixels can be
 * read. */
TL_INLINE void sum_up_pixels(const run_plane *plane, int from, const float *g_out, int n_pixels, int n,
                             int64_t n_columns, int has_room, vq4 sums[2])
{
    const vq4 zero = vq4_set1(0.0f);
    run_columns columns = columns_from(from), summed = columns_from(0);
    sums[0] = sums[1] = zero;
    for (int i = 0; i < TL_SUMMED && i < n_pixels; i += 4) {
        const vq4 at = plane_at_pixels(plane, &columns), inverse = inverse_at_pixels(plane, &columns);
        const vq4 g = vq4_mul(load_gradients(g_out + n_columns * i, n_pixels - i, n, n_columns, has_room), inverse);
        const vq4 of_total = vq4_sub(zero, vq4_sum(vq4_mul(g, vq4_mul(at, inverse))));
        const vq4 h = vq4_first(TL_VQ4_BLEND(g, of_total, 8), n_pixels - i);
        sums[0] = vq4_add(sums[0], h), sums[1] = vq4_add(sums[1], vq4_mul(h, summed.quads));
        next_columns(&columns), next_columns(&summed);
    }
}

/* Adds the gradients of n attributes at the pixels of a run, none of which is clamped. */
TL_INLINE void backward_three(const tl_grad_view *view, const grad_span *s, int r, const float *g_out, int n,
                              int64_t n_columns, const double *begins, double *moments)
{
    const run_plane plane = plane_of_run(s, r);
    const int n_pixels = s->begins[r + 1] - s->begins[r];
    for (int first = 0; first < n_pixels; first += TL_SUMMED) {
        vq4 sums[2];
        sum_up_pixels(&plane, first, g_out + n_columns * first, n_pixels - first, n, n_columns, 0, sums);
        add_moments(view, s, r, first, s->inverses[r], begins, moments, sums[0], sums[1]);
    }
}

/* The gradients at a run that is clamped somewhere, in float64, straight to the corners. */
static void backward_clamped(const tl_grad_view *view, const tl_grad_colors *p, const pixel_run *run)
{
    const tl_grad_values *v = &p->values;
    const double x = middle_at(view, 0, run->column), y = middle_at(view, 1, run->row);
    double sums[FACE_X + 12] = {0}, *to[3];
    int64_t rows[3];
    grad_triangle t;
    row_sums s;
    memset(&s, 0, sizeof s);
    load_seen_triangle(view, run->id, x, y, &t, 0);
    for (int k = 0; k < 3; k++) {
        rows[k] = v->n_columns * p->corners[3 * (int64_t)run->id + k];
        to[k] = sums_of(p->attr, p->corners[3 * (int64_t)run->id + k]) + p->first_column;
    }
    for (int64_t i = 0; i < run->n; i++) {
        const float *rast = (const float *)v->rast + 4 * (run->at + i);
        point_gradients g_point = {0};
        for (int64_t c = 0; c < v->n_columns; c++) {
            const double g = get_real(v->out, v->n_columns * (run->at + i) + c, 0);
            double step[2];
            attr_steps(v, rows, c, step, 0);
            g_point.u += g * step[0], g_point.v += g * step[1];
            add_to_corners(to, c, g * (double)rast[0], g * (double)rast[1], g);
        }
        backward_point(view, &t, &g_point, 2.0 * view->scale[0] * (double)i, 0, &s);
    }
    add_row_sums(s.a, s.a_x, x, y, sums);
    finish_triangle(view, run->id, sums, p->vertices, 0);
}

/* The pixels of a band, but for what its triangles have summed up; n_columns: of the attributes, a constant for few. */
TL_INLINE int64_t backward_color_rows(const tl_grad_view *view, const tl_grad_colors *p, int64_t n_columns)
{
    const tl_grad_values *v = &p->values;
    grad_span s = TL_BEFORE_SPANS(view);
    while (next_grad_span(view, &(id_rows){.rast = v->rast}, view->n_vertices, &s)) {
        set_point_numbers(view, &s, s.inverses);
        find_corners(&s, p->corners, view->n_triangles, p->values.n_attr); /* others than those of the points, maybe */
        for (int64_t c = 0; c < n_columns; c += 3) {
            const int n = n_columns - c < 3 ? (int)(n_columns - c) : 3;
            set_color_quads(&s, v, c, n);
            for (int r = 0; r < s.n_runs; r++) {
                const pixel_run run = run_of_span(view, &s, r);
                const float *rast = (const float *)v->rast + 4 * run.at;
                if (run.id < 0)
                    continue;
                if (is_unclamped(rast, INFINITY) && is_unclamped(rast + 4 * (run.n - 1), INFINITY)) {
                    double *sums = sums_for(view, p->faces, &s, r);
                    backward_three(view, &s, r, (const float *)v->out + n_columns * run.at + c, n, n_columns, sums,
                                   sums + sums_of_three(c));
                } else if (c == 0) {
                    backward_clamped(view, p, &run);
                }
            }
        }
    }
    return s.bad_id;
}

static int64_t backward_colors(const tl_grad_view *view, const tl_grad_colors *p)
{
    switch (p->values.n_columns) {
    case 1: return backward_color_rows(view, p, 1);
    case 3: return backward_color_rows(view, p, 3);
    default: return backward_color_rows(view, p, p->values.n_columns);
    }
}

/* Where triangles to close have their sums: from `moments` on, `stride` further for each three attributes. */
typedef struct {
    int64_t moments, stride;
    /* The corners of triangles, which are their rows of attributes, too, and the pixels that sums count from, by the
     * total there.  NULL: corners as they stand in the mesh; sums count from x and y, which are the first two. */
    int32_t *const *corners;
    const int32_t *column, *row;
} face_places;

/* TL_LANES triangles to close, of which n have sums: the rows of their corners and attributes. */
typedef struct {
    const double *sums; /* of the first one */
    int64_t n_columns;
    const face_places *places;
    int64_t first;
    int n;
    int32_t from[TL_MAX_LANES]; /* 0, 1, 2 and so on; the first one's beyond n */
    int32_t corners[3][TL_MAX_LANES], rows[3][TL_MAX_LANES];
    vd v[3][3], q[3][3], units[3];
} face_lanes;

TL_INLINE void load_faces(const tl_grad_view *view, const tl_grad_colors *p, const int32_t *ids, face_lanes *l, vd *x0,
                          vd *y0)
{
    const int32_t *const corners[3] = {l->corners[0], l->corners[1], l->corners[2]};
    const face_places *places = l->places;
    double about[2][TL_MAX_LANES];
    vd z[3];
    for (int i = 0; i < TL_LANES; i++)
        l->from[i] = i < l->n ? i : 0;
    if (places->corners) { /* lanes beyond n have corners, too */
        for (int k = 0; k < 3; k++) {
            const vi some = vi_load(places->corners[k] + l->first);
            vi_store(l->corners[k], some), vi_store(l->rows[k], some);
        }
        *x0 = middles_at(view, 0, vi_load(places->column + l->first));
        *y0 = middles_at(view, 1, vi_load(places->row + l->first));
    } else {
        for (int i = 0; i < TL_LANES; i++) {
            const int64_t id = 3 * (int64_t)ids[l->from[i]];
            for (int k = 0; k < 3; k++)
                l->corners[k][i] = view->tri[id + k], l->rows[k][i] = p->corners[id + k];
            for (int k = 0; k < 2; k++)
                about[k][i] = l->sums[l->from[i] * l->n_columns + k];
        }
        *x0 = vd_load(about[0]), *y0 = vd_load(about[1]);
    }
    load_triangles(view, corners, *x0, *y0, l->v, l->q, z);
    const vd total = sum_of_three(l->q[0][2], l->q[1][2], l->q[2][2]), one = vd_set1(1.0);
    const vd unit = places->corners ? vd_div(one, one_for_zero(total)) : one;
    for (int c = 0; c < 3; c++)
        l->units[c] = places->corners && c < 2 ? vd_mul(vd_set1(2.0 * view->scale[c]), unit) : unit;
}

/* Adds four columns of n lanes to the rows of their corners, one triangle after the other, from column `first` on. */
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
TL_INLINE void find_rows(tl_grad_sums *sums, int n, const int32_t rows[3][TL_MAX_LANES], double *to[3][TL_MAX_LANES])
{
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++)
            to[k][i] = sums_of(sums, rows[k][i]);
}

/* Adds the gradients of the attributes of corners; returns those of q_k, added. */
TL_INLINE void finish_attributes(const tl_grad_colors *p, const face_lanes *l, double *const to[3][TL_MAX_LANES],
                                 vd by_q[3][3])
{
    const int64_t n = p->values.n_columns;
    for (int64_t first = 0; first < n; first += 3) {
        const double *moments = l->sums + l->places->moments + first / 3 * l->places->stride;
        vd m[12], at[3][3], found[3][4];
        for (int j = 0; j < 12; j += 4)
            vd_load_records(moments + j, (int)l->n_columns, l->from, m + j);
        for (int j = 0; j < 12; j++)
            m[j] = vd_mul(m[j], l->units[j / 4]);
        for (int k = 0; k < 3; k++) {
            load_attributes(p->values.attr, n, first, l->rows[k], at[k]);
            for (int c = 0; c < 3; c++)
                found[k][c] =
                    sum_of_three(vd_mul(l->q[k][0], m[c]), vd_mul(l->q[k][1], m[4 + c]), vd_mul(l->q[k][2], m[8 + c]));
            found[k][3] = vd_set1(0.0);
        }
        add_rows(l->n, to, p->first_column + first, found);
        for (int j = 0; j < 3; j++)
            for (int c = 0; c < 3; c++) {
                by_q[0][j] = vd_add(by_q[0][j], vd_mul(vd_sub(at[0][c], at[2][c]), m[4 * j + c]));
                by_q[1][j] = vd_add(by_q[1][j], vd_mul(vd_sub(at[1][c], at[2][c]), m[4 * j + c]));
                for (int k = 0; k < 3 && c == 0; k++)
                    by_q[k][j] = vd_add(by_q[k][j], m[4 * j + 3]);
            }
    }
}

/* Gradients of the corners of triangles and of their attributes from their sums, as backward_corners gives them. */
static void finish_triangles(const tl_grad_view *view, const tl_grad_colors *p, const int32_t *ids, face_lanes *l)
{
    vd x0, y0, by_q[3][3], g[3][4];
    double *to[3][TL_MAX_LANES];
    load_faces(view, p, ids, l, &x0, &y0);
    for (int k = 0; k < 9; k++)
        by_q[k / 3][k % 3] = g[k / 3][k % 3] = vd_set1(0.0);
    find_rows(p->attr, l->n, l->rows, to);
    finish_attributes(p, l, to, by_q);
    for (int k = 0; k < 3; k++) { /* q_k = v_i x v_j */
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        for (int a = 0; a < 3; a++) {
            const int b = (a + 1) % 3, c = (a + 2) % 3;
            g[i][a] = vd_add(g[i][a], vd_sub(vd_mul(l->v[j][b], by_q[k][c]), vd_mul(l->v[j][c], by_q[k][b])));
            g[j][a] = vd_add(g[j][a], vd_sub(vd_mul(l->v[i][c], by_q[k][b]), vd_mul(l->v[i][b], by_q[k][c])));
        }
    }
    for (int k = 0; k < 3; k++) { /* none of z */
        g[k][3] = vd_sub(g[k][2], vd_add(vd_mul(x0, g[k][0]), vd_mul(y0, g[k][1])));
        g[k][2] = vd_set1(0.0);
    }
    if (p->vertices != p->attr)
        find_rows(p->vertices, l->n, l->corners, to);
    add_rows(l->n, to, 0, g);
}

/* Ends a band: from sums of triangles to those of their corners. */
TL_INLINE void finish_colors(const tl_grad_view *view, const tl_grad_colors *p, const face_places *places)
{
    const tl_grad_sums *faces = p->faces;
    for (int64_t i = 0; i < faces->n; i += TL_LANES) {
        face_lanes l = {.sums = faces->sums + i * faces->n_columns,
                        .n_columns = faces->n_columns,
                        .places = places,
                        .first = i,
                        .n = (int)(faces->n - i < TL_LANES ? faces->n - i : TL_LANES)};
        finish_triangles(view, p, faces->rows + i, &l);
    }
    reset_band(p->faces);
    flush_band(p->vertices);
    flush_band(p->attr);
}

/* See kernels.h. */
static int64_t grad_colors_vjp(const tl_grad_view *view, const tl_grad_colors *p)
{
    const int64_t bad_id = backward_colors(view, p);
    finish_colors(view, p, &(face_places){.moments = FACE_X, .stride = TL_SUMS_OF_THREE});
    return bad_id;
}

#endif
