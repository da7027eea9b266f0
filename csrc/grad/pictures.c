/* Pictures of attributes of float32 with smooth edges, and backward: from the gradients of a picture, or in one pass
 * from its mean squared difference from a target.  A band is processed row by row while the rows are in the cache.
 * In: ids of a picture, a mesh with attributes; backward: gradients, or the target.  Out: the picture; backward: sums
 * by vertex and by row of attributes, a sum of squares.
 *
 * Attributes are quotients of the planes of faces.  A run of pixels starts in float64 and is computed in float32; a run
 * with a clamped weight is computed in float64, as in points.c.  Pass of a row: drawn; finished once the next two rows
 * are drawn; backward once these are finished; all in one buffer. */
#ifndef TL_GRAD_PICTURES_C
#define TL_GRAD_PICTURES_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "grad/colors.c"
#include "grad/edges.c"
#include "grad/faces.c"
#include "grad/grad.h"
#include "grad/pixels.h"
#include "grad/points.c"
#include "grad/values.c"
#include "lanes/lanes.h"
#include "lanes/quads.h"

enum { ROWS_WAITING = 4 }; /* rows that stay in the buffer until their backward is done */

/* The rows in the buffer, addressed as a picture. */
TL_INLINE float *as_picture(const picture_pass *p)
{
    return (float *)((uintptr_t)p->rows - 4 * (uintptr_t)(p->base * p->view->width * p->l->n_columns));
}

/* Computes the steps of colour across the pairs within a row and with the row before, and what the pairs move. */
static void find_steps(const picture_pass *p, int64_t row)
{
    const int64_t n = p->l->n_columns, *pairs = p->l->row_pairs + (row - p->all.first_row);
    const tl_grad_edges e = {.color = as_picture(p), .n_channels = n};
    const int is_moved = p->l->edges.rule != TL_PAIR_STRAIGHT;
    double *moves = p->moves[0][row % 2];
    for (int64_t i = pairs[0]; i < pairs[1]; i++, moves += 2 * n)
        for (int64_t c = 0; c < n; c++) {
            const tl_pair_edge *edge = &p->pairs[i].edge;
            const double step = color_step(&e, &p->pairs[i].pair, c, 0);
            p->l->steps[n * i + c] = (float)step;
            moves[c] = is_moved && edge->near != 0.0 ? edge->near * step : 0.0;
            moves[n + c] = is_moved && edge->far != 0.0 ? edge->far * step : 0.0;
        }
}

/* Gradients of the edges of a row's pairs, and of the colours that the pairs move. */
static void backward_pairs(const picture_pass *p, int64_t row)
{
    const int64_t n = p->l->n_columns, *pairs = p->l->row_pairs + (row - p->all.first_row);
    tl_grad_edges e = {.g_out = as_picture(p), .n_channels = n};
    double *moves = p->moves[1][row % 2];
    for (int64_t i = pairs[0]; i < pairs[1]; i++, moves += 2 * n) {
        const tl_pair *pair = &p->pairs[i].pair;
        double g_near = 0.0, g_far = 0.0;
        e.steps = p->l->steps + n * i;
        if (p->l->edges.rule == TL_PAIR_STRAIGHT) {
            backward_straight(p->view, &e, pair, p->l->vertices);
            continue;
        }
        for (int64_t c = 0; c < n; c++)
            moves[c] = moves[n + c] = backward_column(&e, pair, &p->pairs[i].edge, c, &g_near, &g_far, 0);
        if (in_band(p->view, pair->near < pair->far ? pair->near : pair->far))
            backward_edge(p->view, pair, &p->pairs[i].edge, g_near, g_far, p->l->vertices);
    }
}

/* Moves colours, or gradients, between the pixels of the pairs of a row. */
static void move_between(const picture_pass *p, int64_t row, int is_back)
{
    const int64_t n = p->l->n_columns, *pairs = p->l->row_pairs + (row - p->all.first_row);
    const double *moves = p->moves[is_back][row % 2];
    float *picture = as_picture(p);
    for (int64_t i = pairs[0]; i < pairs[1] && p->l->edges.rule != TL_PAIR_STRAIGHT; i++, moves += 2 * n) {
        float *near = picture + n * p->pairs[i].pair.near, *far = picture + n * p->pairs[i].pair.far;
        for (int64_t c = 0; c < n; c++) {
            near[c] = (float)((double)near[c] + moves[c]);
            far[c] = (float)((double)far[c] - moves[n + c]);
        }
    }
}

/* A plane of a face at a pixel, at x, y from the first pixel of the face; `plane_of_face`: along a row from there. */
TL_INLINE vqd plane_at_place(const double *plane, double x, double y)
{
    const vqd in_row = vqd_add(vqd_load(plane + 8), vqd_mul(vqd_load(plane), vqd_set1(x)));
    return vqd_add(in_row, vqd_mul(vqd_load(plane + 4), vqd_set1(y)));
}
TL_INLINE run_plane plane_of_face(const double *plane, double x, double y)
{
    return run_plane_of(vq_from_vqd(plane_at_place(plane, x, y)), vq_from_vqd(vqd_load(plane)));
}

/* Whether the n pixels of a run, at x, y from the first pixel of the face, lie well within their triangle. */
TL_INLINE int is_within(const double *face, double x, double y, int64_t n)
{
    const vqd at = plane_at_place(face, x, y), last = vqd_add(at, vqd_mul(vqd_load(face), vqd_set1((double)(n - 1))));
    const unsigned wanted = 1u << FACE_U | 1u << FACE_V | 1u << FACE_REST;
    return (vqd_above_zero(at, last) & wanted) == wanted;
}

/* `rast` of a run with clamped weights: a pointer that is indexed by the pixel in the picture. */
static const float *points_of_clamped(const picture_pass *p, const pixel_run *run)
{
    void *const out[2] = {(void *)((uintptr_t)p->l->rast - 16 * (uintptr_t)(run->row * p->view->width)), 0};
    grad_triangle t;
    load_seen_triangle(p->view, run->id, middle_at(p->view, 0, run->column), middle_at(p->view, 1, run->row), &t, 0);
    for (int64_t i = 0; i < run->n; i++)
        store_point(p->view, &t, run, i, 2.0 * p->view->scale[0] * (double)i, out, 0);
    return out[0];
}

/* Run r of a row, n pixels of a face, as a pixel_run. */
TL_INLINE pixel_run run_of_face(const picture_pass *p, int64_t r, int64_t row, int64_t n)
{
    const int64_t column = p->l->begins[r];
    return (pixel_run){.id = p->l->faces->rows[p->faces[r] >> 1],
                       .row = row,
                       .column = column,
                       .at = row * p->view->width + column,
                       .n = n};
}

TL_ONCE void draw_clamped(const picture_pass *p, int64_t r, int64_t row, int64_t n_pixels, float *colors)
{
    const int64_t n = p->l->n_columns;
    const pixel_run run = run_of_face(p, r, row, n_pixels);
    int64_t rows[3];
    const tl_grad_values v = {.attr = p->l->attr,
                              .rast = points_of_clamped(p, &run),
                              .out = (void *)((uintptr_t)colors - 4 * (uintptr_t)(n * row * p->view->width))};
    attr_rows(p->view, run.id, n, rows);
    for (int64_t c = 0; c < n; c += TL_FEW_COLUMNS)
        values_of_run(&v, &run, rows, c, n - c < TL_FEW_COLUMNS ? (int)(n - c) : TL_FEW_COLUMNS, n, 0);
}

/* Draws n of n_columns attributes from `first` on at the pixels of a run, at x, y from the first pixel of the face. */
TL_INLINE void draw_three(const double *face, int64_t first, int n, int64_t n_columns, double x, double y,
                          int64_t n_pixels, float *colors)
{
    const double *three = face + place_of_three(first);
    const vq4 last = vq4_all(vq_from_vqd(vqd_load(three + THREE_LAST)));
    for (int64_t begin = 0; begin < n_pixels; begin += TL_SUMMED) {
        const run_plane plane = plane_of_face(three, x + (double)begin, y);
        run_columns columns = columns_from(0);
        for (int i = 0; i < TL_SUMMED && begin + i < n_pixels; i += 4, next_columns(&columns)) {
            const vq4 at = plane_at_pixels(&plane, &columns);
            const vq4 color = vq4_add(vq4_mul(at, inverse_at_pixels(&plane, &columns)), last);
            const int64_t n_left = n_pixels - begin - i;
            float some[16], *to = colors + n_columns * (begin + i) + first;
            vq4_store(n == n_columns ? to : some, color, 4, n); /* pixels to the right are drawn later */
            for (int64_t k = 0; n < n_columns && k < 4 && k < n_left; k++)
                memcpy(to + n_columns * k, some + n * k, (size_t)n * sizeof *some);
        }
    }
}

/* The next input row to finish: of the picture, its gradients or the target; the buffer for rows outside of the
 * band. */
TL_INLINE const float *row_ahead(const picture_pass *p, int64_t row)
{
    const tl_grad_picture *l = p->l;
    const float *numbers = l->target ? l->target : l->g_out ? l->g_out : l->out;
    return row < p->view->first_row || row >= p->view->end_row ? p->rows
                                                               : numbers + row * p->view->width * l->n_columns;
}

/* Prefetches pixels of the row ahead while others are computed. */
TL_INLINE void fetch_ahead(const float *ahead, int64_t column, int64_t n_pixels, int64_t n_columns)
{
    for (int64_t i = n_columns * column; i < n_columns * (column + n_pixels); i += 16)
        __builtin_prefetch(ahead + i);
}

TL_INLINE void draw_row(const picture_pass *p, int64_t row, const float *ahead, int64_t n_columns)
{
    const int64_t end = p->l->row_runs[row + 1 - p->all.first_row], width = p->view->width, n = width * n_columns;
    const int64_t n_of_face = p->l->faces->n_columns;
    const int32_t *begins = p->l->begins, *faces = p->faces;
    const double *numbers = p->l->faces->sums;
    float *colors = p->rows + (row - p->base) * n;
    for (int64_t r = p->l->row_runs[row - p->all.first_row]; r < end; r++) {
        const int64_t column = begins[r], n_pixels = (r + 1 < end ? begins[r + 1] : width) - column;
        float *to = colors + n_columns * column;
        fetch_ahead(ahead, column, n_pixels, n_columns);
        if (faces[r] < 0) {
            memset(to, 0, (size_t)(n_columns * n_pixels) * sizeof *to);
            continue;
        }
        const double *face = numbers + (faces[r] >> 1) * n_of_face;
        const double x = (double)column - face[FACE_COLUMN], y = (double)row - face[FACE_ROW];
        if (!is_within(face, x, y, n_pixels)) {
            p->faces[r] |= 1;
            draw_clamped(p, r, row, n_pixels, colors);
            continue;
        }
        for (int64_t c = 0; c < n_columns; c += 3)
            draw_three(face, c, n_columns - c < 3 ? (int)(n_columns - c) : 3, n_columns, x, y, n_pixels, to);
    }
}

/* numbers compared at a time; squares that are summed in float32 */
enum { COMPARED = 32, SQUARED = 256 };

/* Overwrites numbers with their gradient; adds the squares of their differences. */
TL_INLINE void compare_some(float *out, const float *target, vf scale, vf *squares)
{
    for (int k = 0; k < COMPARED; k += TL_LANES) {
        const vf step = vf_sub(vf_load(out + k), vf_load(target + k));
        vf_store(out + k, vf_mul(step, scale));
        squares[k / TL_LANES] = vf_add(squares[k / TL_LANES], vf_mul(step, step));
    }
}

/* Overwrites a row with its gradient; returns the sum of the squares of the differences. */
static double compare_row(const picture_pass *p, int64_t row)
{
    const int64_t n = p->view->width * p->l->n_columns;
    float *restrict out = p->rows + (row - p->base) * n;
    const float *restrict target = p->l->target + row * n;
    const vf scale = vf_set1((float)p->l->scale);
    vqd sum = vqd_set1(0.0);
    double sums[4];
    for (int64_t first = 0; first < n; first += SQUARED) {
        const int64_t end = n - first < SQUARED ? n : first + SQUARED;
        vf squares[COMPARED / TL_LANES];
        float some[COMPARED], last[2][COMPARED] = {{0}};
        int64_t i = first;
        for (int k = 0; k < COMPARED / TL_LANES; k++)
            squares[k] = vf_set1(0.0f);
        for (; i + COMPARED <= end; i += COMPARED)
            compare_some(out + i, target + i, scale, squares);
        if (i < end) {
            const size_t size = (size_t)(end - i) * sizeof(float);
            memcpy(last[0], out + i, size), memcpy(last[1], target + i, size);
            compare_some(last[0], last[1], scale, squares);
            memcpy(out + i, last[0], size);
        }
        for (int k = 0; k < COMPARED / TL_LANES; k++)
            vf_store(some + k * TL_LANES, squares[k]);
        for (int k = 0; k < COMPARED; k += 8)
            sum = vqd_add(sum, vqd_from_vq(vq_load(some + k) + vq_load(some + k + 4)));
    }
    vqd_store(sums, sum);
    return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

/* Finishes a row: stores it, compares it with the target, or loads its gradients; returns a sum of squares. */
static double finish_row(const picture_pass *p, int64_t row)
{
    const int64_t n = p->view->width * p->l->n_columns;
    float *kept = p->rows + (row - p->base) * n;
    if (p->l->target)
        return compare_row(p, row);
    if (p->l->g_out)
        memcpy(kept, p->l->g_out + row * n, (size_t)n * sizeof *kept);
    else if (row >= p->view->first_row && row < p->view->end_row)
        memcpy(p->l->out + row * n, kept, (size_t)n * sizeof *kept);
    return 0.0;
}

TL_ONCE void backward_clamped_run(const picture_pass *p, int64_t r, int64_t row, int64_t n_pixels)
{
    const pixel_run run = run_of_face(p, r, row, n_pixels);
    const tl_grad_values values = {
        .attr = p->l->attr, .n_columns = p->l->n_columns, .rast = points_of_clamped(p, &run), .out = as_picture(p)};
    backward_clamped(p, &values, &run);
}

/* Adds the gradients of a row to the sums of its faces.  `ahead` may be NULL. */
TL_INLINE void backward_row(const picture_pass *p, int64_t row, const float *ahead, int64_t n_columns)
{
    const int64_t end = p->l->row_runs[row + 1 - p->all.first_row], width = p->view->width;
    const int64_t n_of_face = p->l->faces->n_columns;
    const int32_t *begins = p->l->begins, *faces = p->faces;
    const float *gradients = p->rows + (row - p->base) * width * n_columns;
    double *numbers = p->l->faces->sums;
    for (int64_t r = p->l->row_runs[row - p->all.first_row]; r < end; r++) {
        const int64_t column = begins[r], n_pixels = (r + 1 < end ? begins[r + 1] : width) - column;
        if (ahead)
            fetch_ahead(ahead, column, n_pixels, n_columns);
        if (faces[r] < 0)
            continue;
        if (faces[r] & 1) {
            backward_clamped_run(p, r, row, n_pixels);
            continue;
        }
        double *face = numbers + (faces[r] >> 1) * n_of_face;
        const double y = (double)row - face[FACE_ROW];
        for (int64_t c = 0; c < n_columns; c += 3) {
            double *three = face + place_of_three(c);
            for (int64_t first = 0; first < n_pixels; first += TL_SUMMED) {
                const double x = (double)(column + first) - face[FACE_COLUMN];
                const run_plane plane = plane_of_face(three, x, y);
                const float *g = gradients + n_columns * (column + first) + c;
                vq4 sums[2];
                sum_up_pixels(&plane, g, (int)(n_pixels - first), n_columns - c < 3 ? (int)(n_columns - c) : 3,
                              n_columns, sums);
                add_three_moments(three + THREE_SUMS, vqd_from_vq(vq4_fold(sums[0])), vqd_from_vq(vq4_fold(sums[1])), x,
                                  y);
            }
        }
    }
}

/* Draws, finishes and runs backward each row in its place in the buffer.  What the pairs of a row move is added after
 * the pairs of the next row are computed. */
TL_INLINE double pass_rows(picture_pass *p, int64_t n_columns)
{
    const tl_grad_view *view = p->view;
    const int64_t n = view->width * n_columns, first = p->all.first_row, end = p->all.end_row;
    const int is_back = !p->l->out, has_picture = !p->l->g_out;
    const int64_t taken = view->first_row > 0 ? view->first_row - 1 : 0;
    const int64_t taken_end = view->end_row < view->height ? view->end_row + 1 : view->height;
    double sum = 0.0;
    for (int64_t row = first; row < view->end_row + ROWS_WAITING; row++) {
        if (row - p->base == TL_ROWS_KEPT) {
            memcpy(p->rows, p->rows + (TL_ROWS_KEPT - ROWS_WAITING) * n, (size_t)(ROWS_WAITING * n) * sizeof(float));
            p->base = row - ROWS_WAITING;
        }
        const float *ahead = row_ahead(p, row - 1);
        if (row < end && has_picture) {
            draw_row(p, row, ahead, n_columns);
            find_steps(p, row);
        }
        if (row > first && row <= end && has_picture)
            move_between(p, row - 1, 0);
        if (row - 2 >= taken && row - 2 < taken_end) {
            const double found = finish_row(p, row - 2);
            sum += row - 2 >= view->first_row && row - 2 < view->end_row ? found : 0.0;
            if (is_back && row - 2 >= view->first_row)
                backward_pairs(p, row - 2);
        }
        if (is_back && row - 3 >= view->first_row && row - 3 < taken_end)
            move_between(p, row - 3, 1);
        if (is_back && row - ROWS_WAITING >= view->first_row)
            backward_row(p, row - ROWS_WAITING, has_picture ? 0 : ahead, n_columns);
    }
    return sum;
}

/* See kernels.h. */
static double grad_picture(const tl_grad_view *view, tl_grad_picture *l)
{
    picture_pass p = open_pass(view, l);
    double sum;
    if (l->g_out)
        take_faces(&p);
    else
        list_faces(&p);
    set_up_faces(&p);
    if (!l->g_out)
        list_row_pairs(&p);
    switch (l->n_columns) {
    case 1: sum = pass_rows(&p, 1); break;
    case 3: sum = pass_rows(&p, 3); break;
    default: sum = pass_rows(&p, l->n_columns);
    }
    if (l->out)
        reset_band(l->faces);
    else
        finish_faces(&p);
    return sum;
}

#endif
