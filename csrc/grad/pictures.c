/* Pictures of attributes of float32 with smooth edges, and backwards: from the gradients of a picture, or at once from
 * its mean squared difference from another one.  A band goes row by row while they are in the cache.
 * In: ids of a picture, a mesh with attributes; backward: gradients, or the other picture.  Out: the picture; backward:
 * sums by vertex and by row of attributes, a sum of squares.
 *
 * A triangle that is seen is a face: planes in float64, about the first pixel that shows it and in units of its total
 * there, whose quotients are the attributes at its pixels; and the sums of colors.c.  A run of pixels begins in float64
 * and goes on in float32; one with a weight that is clamped goes by itself, as in points.c.  Runs, faces and pairs of
 * pixels are found once for both ways.  A row is drawn, finished when the next two are drawn, and led back when these
 * are finished: all in one place. */
#ifndef TL_GRAD_PICTURES_C
#define TL_GRAD_PICTURES_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "grad/colors.c"
#include "grad/edges.c"
#include "grad/pixels.h"
#include "grad/points.c"
#include "grad/values.c"
#include "lanes/lanes.h"
#include "lanes/quads.h"

/* Planes of a face: by column, by row, and at its first pixel; four numbers each.  Where the last is above 0 the sum of
 * the weights is below 1.  Then that pixel's column and row; and of each three attributes their planes, those of the
 * last corner, and sums as many as planes. */
enum { FACE_U, FACE_V, FACE_ZW, FACE_REST, FACE_TOTAL = FACE_REST, FACE_PLANE = 12, FACE_COLUMN = 12, FACE_ROW };
enum { ROWS_WAITING = 4 }; /* of those that are kept, before a row has been led back */
enum { FACE_QUADS = 4 * 4, THREE_LAST = FACE_PLANE, THREE_SUMS = FACE_QUADS };

/* A band, with the rows on either side of it that it takes part in: runs of pixels of equal id, faces, pairs. */
typedef struct {
    const tl_grad_view *view;
    tl_grad_picture *l;
    tl_grad_view all;                        /* of those rows */
    int32_t *faces;                          /* of runs: twice the face, 1 more where clamped, less than 0 for none */
    int32_t *corners[3], *column, *row, *id; /* of faces */
    tl_met_pair *pairs;
    float *rows; /* TL_ROWS_KEPT rows from `base` on: colours, which become gradients */
    int64_t base;
    double
        *moves[2][2]; /* forward and back, of even and odd rows: what pairs add to the near pixel, take from the far */
} picture_pass;

_Static_assert(sizeof(tl_met_pair) == TL_PAIR_BYTES, "callers make room for pairs");

static picture_pass open_pass(const tl_grad_view *view, tl_grad_picture *l)
{
    picture_pass p = {.view = view, .l = l, .all = *view, .faces = l->run_faces, .pairs = l->pairs};
    const int64_t reach = l->target ? 2 : 1;
    p.all.first_row = view->first_row > reach ? view->first_row - reach : 0;
    p.all.end_row = view->end_row + reach < view->height ? view->end_row + reach : view->height;
    int32_t **const of_faces[TL_FACE_ROWS] = {&p.corners[0], &p.corners[1], &p.corners[2], &p.column, &p.row, &p.id};
    for (int k = 0; k < TL_FACE_ROWS; k++)
        *of_faces[k] = l->of_faces + k * l->face_step;
    p.rows = l->window;
    for (int k = 0; k < 4; k++)
        p.moves[k / 2][k % 2] = l->moves + 4 * k * view->width * l->n_columns;
    p.base = p.all.first_row;
    return p;
}

/* The face of a triangle that a pixel shows; -1 if its corners do not exist. */
TL_INLINE int32_t find_face(picture_pass *p, int32_t id, int32_t column, int64_t row)
{
    const tl_grad_view *view = p->view;
    const int64_t n_rows = p->l->n_attr < view->n_vertices ? p->l->n_attr : view->n_vertices;
    if (id < 0 || id >= view->n_triangles)
        return -1;
    int32_t face = p->l->faces->slot_of[id];
    if (face >= 0 || !has_corners(view, n_rows, id))
        return face;
    face = p->l->faces->slot_of[id] = (int32_t)p->l->faces->n++;
    p->l->faces->rows[face] = id;
    for (int k = 0; k < 3; k++)
        p->corners[k][face] = view->tri[3 * (int64_t)id + k];
    p->column[face] = column, p->row[face] = (int32_t)row, p->id[face] = id;
    return face;
}

/* Lists where the runs of a row begin; returns how many there are.  Numbers that are no triangle's are runs, too. */
TL_INLINE int64_t list_row_runs(const picture_pass *p, const int32_t *ids, int32_t *begins)
{
    const int64_t width = p->view->width;
    const vi none = vi_set1(-1);
    vi before = vi_set1(INT32_MIN);
    int64_t n = 0;
    for (int64_t x = 0; x < width; x += TL_LANES) {
        const vm m = vm_first(width - x);
        const vi id = vi_max(x + TL_LANES <= width ? vi_load(ids + x) : vi_load_masked(m, ids + x), none);
        const vm starts = vm_and_not(m, vi_eq(id, vi_shift_in(id, before)));
        vi_compress(begins + n, starts, vi_add(vi_iota(), vi_set1((int32_t)x)));
        n += __builtin_popcount(vm_bits(starts));
        before = id;
    }
    return n;
}

/* Lists runs, row by row, and faces in the order of their first pixels. */
static void list_faces(picture_pass *p)
{
    int64_t n_runs = 0;
    for (int64_t row = p->all.first_row; row < p->all.end_row; row++) {
        const int32_t *ids = p->l->ids + p->l->step * row;
        const int64_t first = n_runs;
        p->l->row_runs[row - p->all.first_row] = n_runs;
        n_runs += list_row_runs(p, ids, p->l->begins + n_runs);
        for (int64_t r = first; r < n_runs; r++)
            p->faces[r] = 2 * find_face(p, ids[p->l->begins[r]], p->l->begins[r], row);
    }
    p->l->row_runs[p->all.end_row - p->all.first_row] = n_runs;
    for (int k = 0; k < TL_IDS_ROOM; k++) {
        const int64_t at = p->l->faces->n + k;
        p->corners[0][at] = p->corners[1][at] = p->corners[2][at] = p->column[at] = p->row[at] = 0;
    }
    p->l->n_faces = p->l->faces->n;
}

/* Takes the faces that the picture has left. */
static void take_faces(const picture_pass *p)
{
    tl_grad_sums *faces = p->l->faces;
    for (faces->n = 0; faces->n < p->l->n_faces; faces->n++)
        faces->rows[faces->n] = p->id[faces->n];
}

/* Planes of TL_LANES faces: of the weights, of z/w and of the total. */
TL_INLINE void set_face_planes(const picture_pass *p, int64_t first, vd planes[FACE_PLANE])
{
    const tl_grad_view *view = p->view;
    const int32_t *const corners[3] = {p->corners[0] + first, p->corners[1] + first, p->corners[2] + first};
    const vd steps[3] = {vd_set1(2.0 * view->scale[0]), vd_set1(2.0 * view->scale[1]), vd_set1(1.0)};
    vd v[3][3], q[3][3], z[3];
    load_triangles(view, corners, middles_at(view, 0, vi_load(p->column + first)),
                   middles_at(view, 1, vi_load(p->row + first)), v, q, z);
    const vd inverse = vd_div(vd_set1(1.0), one_for_zero(sum_of_three(q[0][2], q[1][2], q[2][2])));
    const vd under =
        one_for_zero(sum_of_three(vd_mul(v[0][2], q[0][2]), vd_mul(v[1][2], q[1][2]), vd_mul(v[2][2], q[2][2])));
    for (int c = 0; c < 3; c++) {
        const vd unit = vd_mul(inverse, steps[c]);
        const vd over = sum_of_three(vd_mul(z[0], q[0][c]), vd_mul(z[1], q[1][c]), vd_mul(z[2], q[2][c]));
        planes[4 * c + FACE_U] = vd_mul(q[0][c], unit), planes[4 * c + FACE_V] = vd_mul(q[1][c], unit);
        planes[4 * c + FACE_ZW] = vd_mul(vd_div(over, under), steps[c]);
        planes[4 * c + FACE_TOTAL] = vd_mul(sum_of_three(q[0][c], q[1][c], q[2][c]), unit);
    }
}

/* The numbers of a face, and those of three attributes from `first` on. */
TL_INLINE double *face_at(const picture_pass *p, int64_t face)
{
    return p->l->faces->sums + face * p->l->faces->n_columns;
}
TL_INLINE int64_t place_of_three(int64_t first) { return TL_HEAD_OF_FACE + first / 3 * TL_SUMS_OF_FACE; }

/* Stores quads of lanes. */
TL_INLINE void store_quads(const picture_pass *p, int64_t first, int64_t at, const vd quads[FACE_QUADS])
{
    const int64_t n_of_face = p->l->faces->n_columns, n = p->l->faces->n - first;
    double some[FACE_QUADS * TL_MAX_LANES], *to = face_at(p, first) + at;
    const int is_whole = n >= TL_LANES;
    for (int k = 0; k < FACE_QUADS; k += 4)
        vd_store_quads((is_whole ? to : some) + k, is_whole ? n_of_face : FACE_QUADS, quads + k);
    for (int64_t i = 0; !is_whole && i < n; i++)
        memcpy(to + i * n_of_face, some + i * FACE_QUADS, FACE_QUADS * sizeof *some);
}

/* Planes of each three attributes are those less that of the last corner, which follows. */
TL_INLINE void set_attr_planes(const picture_pass *p, int64_t first, int64_t column, vd planes[FACE_QUADS])
{
    vd attr[3][FACE_PLANE], at[3][3];
    for (int k = 0; k < 3; k++)
        load_attributes(p->l->attr, p->l->n_columns, column, p->corners[k] + first, at[k]);
    for (int c = 0; c < 3; c++) {
        const vd by_u = vd_sub(at[0][c], at[2][c]), by_v = vd_sub(at[1][c], at[2][c]);
        for (int j = 0; j < 3; j++)
            attr[c][j] = vd_add(vd_mul(by_u, planes[4 * j + FACE_U]), vd_mul(by_v, planes[4 * j + FACE_V]));
    }
    for (int c = 0; c < 3; c++)
        for (int j = 0; j < 3; j++)
            planes[4 * j + c] = attr[c][j];
    for (int c = 0; c < 3; c++)
        planes[THREE_LAST + c] = at[2][c];
}

static void set_up_faces(const picture_pass *p)
{
    const int64_t n_faces = p->l->faces->n;
    for (int64_t first = 0; first < n_faces; first += TL_LANES) {
        vd of_points[FACE_PLANE], planes[FACE_QUADS];
        set_face_planes(p, first, of_points);
        memcpy(planes, of_points, sizeof of_points);
        for (int j = 0; j < FACE_PLANE; j += 4)
            planes[j + FACE_REST] = vd_sub(vd_mul(of_points[j + FACE_TOTAL], vd_set1(TL_ALMOST_ONE)),
                                           vd_add(of_points[j + FACE_U], of_points[j + FACE_V]));
        planes[FACE_COLUMN] = vd_from_vi(vi_load(p->column + first));
        planes[FACE_ROW] = vd_from_vi(vi_load(p->row + first));
        planes[FACE_ROW + 1] = planes[FACE_ROW + 2] = vd_set1(0.0);
        store_quads(p, first, 0, planes);
        for (int64_t c = 0; c < p->l->n_columns; c += 3) {
            memcpy(planes, of_points, sizeof of_points);
            set_attr_planes(p, first, c, planes);
            store_quads(p, first, place_of_three(c), planes);
            for (int64_t i = first; i < first + TL_LANES && i < n_faces; i++)
                for (int k = 0; k < FACE_PLANE; k += 4)
                    vqd_store(face_at(p, i) + place_of_three(c) + THREE_SUMS + k, vqd_set1(0.0));
        }
    }
}

TL_INLINE double zw_at(const picture_pass *p, int32_t id, int64_t column, int64_t row)
{
    const int32_t face = p->l->faces->slot_of[id];
    const double *plane = face_at(p, face) + FACE_ZW;
    return plane[8] + plane[0] * (double)(column - p->column[face]) + plane[4] * (double)(row - p->row[face]);
}

/* Whether the second pixel of a pair is the nearer one. */
TL_INLINE int is_nearer_at(const picture_pass *p, const tl_pair_list *list, int64_t i)
{
    const int in_column = list->where[i] & TL_IN_COLUMN;
    const int64_t x = list->column[i], row = list->where[i] >> TL_ROW_SHIFT;
    return list->near[i] < 0 || (list->far[i] >= 0 && (float)zw_at(p, list->far[i], x + !in_column, row + in_column) <
                                                          (float)zw_at(p, list->near[i], x, row));
}

/* Finds the pairs of all rows: those with the row below, then those within a row. */
static void list_met_pairs(const picture_pass *p)
{
    const int64_t lowest = p->all.first_row, top = p->all.end_row;
    pair_scan scan = scan_of(&p->all, &p->l->edges, lowest, top);
    tl_pair_list list;
    int32_t which[TL_PAIRS_ROOM];
    int64_t n = 0, row = lowest;
    scan.shown = p->l->ids, scan.step = p->l->step, scan.begins = p->l->begins, scan.row_runs = p->l->row_runs;
    while (next_pairs(&scan, &list, 0)) {
        for (int64_t i = 0; i < list.n; i++)
            list.turned[i] = -is_nearer_at(p, &list, i);
        turn_pairs(&list);
        const int64_t n_met = list_met(p->view, &p->l->edges, &list, which);
        for (int64_t i = 0; i < n_met; i += TL_LANES) {
            const int64_t end = n + meet_some(p->view, &p->l->edges, &list, which + i, n_met - i, p->pairs + n);
            for (; n < end; n++) {
                const tl_pair *pair = &p->pairs[n].pair;
                const int64_t own = (int64_t)pair->middle[1] + (pair->axis && pair->flip > 0.0);
                for (; row <= own; row++)
                    p->l->row_pairs[row - lowest] = n;
            }
        }
    }
    for (; row <= top; row++)
        p->l->row_pairs[row - lowest] = n;
}

/* The pixels of the rows that are kept, as those of a picture. */
TL_INLINE float *as_picture(const picture_pass *p)
{
    return (float *)((uintptr_t)p->rows - 4 * (uintptr_t)(p->base * p->view->width * p->l->n_columns));
}

/* Finds the steps of colour across the pairs of a row, its own and with the row before, and what these move. */
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

/* Finds what the gradients of a row say of its pairs: of their edges, and what these move from pixel to pixel. */
static void pull_pairs(const picture_pass *p, int64_t row)
{
    const int64_t n = p->l->n_columns, *pairs = p->l->row_pairs + (row - p->all.first_row);
    tl_grad_edges e = {.g_out = as_picture(p), .n_channels = n};
    double *moves = p->moves[1][row % 2];
    for (int64_t i = pairs[0]; i < pairs[1]; i++, moves += 2 * n) {
        const tl_pair *pair = &p->pairs[i].pair;
        double g_near = 0.0, g_far = 0.0;
        e.steps = p->l->steps + n * i;
        if (p->l->edges.rule == TL_PAIR_STRAIGHT) {
            pull_straight(p->view, &e, pair, p->l->of_points);
            continue;
        }
        for (int64_t c = 0; c < n; c++)
            moves[c] = moves[n + c] = pull_column(&e, pair, &p->pairs[i].edge, c, &g_near, &g_far, 0);
        if (in_band(p->view, pair->near < pair->far ? pair->near : pair->far))
            pull_edge(p->view, pair, &p->pairs[i].edge, g_near, g_far, p->l->of_points);
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

/* A plane of a face from a pixel on, x and y off its first one. */
TL_INLINE vqd plane_at_place(const double *plane, double x, double y)
{
    const vqd in_row = vqd_add(vqd_load(plane + 8), vqd_mul(vqd_load(plane), vqd_set1(x)));
    return vqd_add(in_row, vqd_mul(vqd_load(plane + 4), vqd_set1(y)));
}
TL_INLINE run_plane plane_of_face(const double *plane, double x, double y)
{
    return run_plane_of(vq_from_vqd(plane_at_place(plane, x, y)), vq_from_vqd(vqd_load(plane)));
}

/* Whether the pixels of a run, x and y off the first one of the face, lie well within their triangle. */
TL_INLINE int is_within(const double *face, double x, double y, int64_t n)
{
    const vqd at = plane_at_place(face, x, y), last = vqd_add(at, vqd_mul(vqd_load(face), vqd_set1((double)(n - 1))));
    const unsigned wanted = 1u << FACE_U | 1u << FACE_V | 1u << FACE_REST;
    return (vqd_above_zero(at, last) & wanted) == wanted;
}

/* `rast` of a run that is clamped somewhere, of which row 0 of the picture would stand there. */
static const float *points_of_clamped(const picture_pass *p, const pixel_run *run)
{
    void *const out[2] = {(void *)((uintptr_t)p->l->rast - 16 * (uintptr_t)(run->row * p->view->width)), 0};
    grad_triangle t;
    load_seen_triangle(p->view, run->id, middle_at(p->view, 0, run->column), middle_at(p->view, 1, run->row), &t, 0);
    for (int64_t i = 0; i < run->n; i++)
        store_point(p->view, &t, run, i, 2.0 * p->view->scale[0] * (double)i, out, 0);
    return out[0];
}

/* Run r of a row, n pixels of a face, as that of a band. */
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

/* n of n_columns attributes from `first` on at the pixels of a run; x and y off the first pixel of the face. */
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

TL_INLINE void draw_row(const picture_pass *p, int64_t row, int64_t n_columns)
{
    const int64_t end = p->l->row_runs[row + 1 - p->all.first_row], width = p->view->width, n = width * n_columns;
    const int64_t n_of_face = p->l->faces->n_columns;
    const int32_t *begins = p->l->begins, *faces = p->faces;
    const double *numbers = p->l->faces->sums;
    float *colors = p->rows + (row - p->base) * n;
    for (int64_t r = p->l->row_runs[row - p->all.first_row]; r < end; r++) {
        const int64_t column = begins[r], n_pixels = (r + 1 < end ? begins[r + 1] : width) - column;
        float *to = colors + n_columns * column;
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

/* Numbers that are compared at a time, and those of which as many squares are summed up in float32. */
enum { COMPARED = 32, SQUARED = 256 };

/* Writes the gradient of some numbers over them; adds the squares of their differences. */
TL_INLINE void compare_some(float *out, const float *target, vf scale, vf *squares)
{
    for (int k = 0; k < COMPARED; k += TL_LANES) {
        const vf step = vf_sub(vf_load(out + k), vf_load(target + k));
        vf_store(out + k, vf_mul(step, scale));
        squares[k / TL_LANES] = vf_add(squares[k / TL_LANES], vf_mul(step, step));
    }
}

/* The same of a row; returns the sum of squares. */
static double compare_row(const picture_pass *p, int64_t row)
{
    const int64_t n = p->view->width * p->l->n_columns;
    float *restrict out = p->rows + (row - p->base) * n;
    const float *restrict target = p->l->target + row * n;
    const int64_t ahead = row + 1 < p->view->height ? n : 0;
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
        for (; i + COMPARED <= end; i += COMPARED) {
            compare_some(out + i, target + i, scale, squares);
            __builtin_prefetch(target + i + ahead), __builtin_prefetch(target + i + ahead + 16);
        }
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

/* Writes a finished row of the picture, compares it, or takes its gradients; returns a sum of squares. */
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

static tl_grad_colors colors_of(const picture_pass *p)
{
    const tl_grad_picture *l = p->l;
    return (tl_grad_colors){
        .values = {.attr = l->attr, .n_attr = l->n_attr, .n_columns = l->n_columns, .out = as_picture(p)},
        .corners = p->view->tri,
        .faces = l->faces,
        .vertices = l->of_points,
        .attr = l->of_attr};
}

TL_ONCE void pull_clamped_run(const picture_pass *p, int64_t r, int64_t row, int64_t n_pixels)
{
    const pixel_run run = run_of_face(p, r, row, n_pixels);
    tl_grad_colors colors = colors_of(p);
    colors.values.rast = points_of_clamped(p, &run);
    pull_clamped(p->view, &colors, &run);
}

/* Adds the gradients of a row to the sums of its faces. */
TL_INLINE void pull_row(const picture_pass *p, int64_t row, int64_t n_columns)
{
    const int64_t end = p->l->row_runs[row + 1 - p->all.first_row], width = p->view->width;
    const int64_t n_of_face = p->l->faces->n_columns;
    const int32_t *begins = p->l->begins, *faces = p->faces;
    const float *gradients = p->rows + (row - p->base) * width * n_columns;
    double *numbers = p->l->faces->sums;
    for (int64_t r = p->l->row_runs[row - p->all.first_row]; r < end; r++) {
        const int64_t column = begins[r], n_pixels = (r + 1 < end ? begins[r + 1] : width) - column;
        if (faces[r] < 0)
            continue;
        if (faces[r] & 1) {
            pull_clamped_run(p, r, row, n_pixels);
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
                sum_up_pixels(&plane, 0, g, (int)(n_pixels - first), n_columns - c < 3 ? (int)(n_columns - c) : 3,
                              n_columns, 1, sums);
                add_three_moments(three + THREE_SUMS, vqd_from_vq(vq4_fold(sums[0])), vqd_from_vq(vq4_fold(sums[1])), x,
                                  y);
            }
        }
    }
}

/* Ends a band: from sums of faces to those of corners. */
static void close_faces(const picture_pass *p)
{
    const tl_grad_colors colors = colors_of(p);
    close_colors(p->view, &colors, place_of_three(0) + THREE_SUMS, TL_SUMS_OF_FACE, p->column, p->row);
}

/* Rows drawn, finished, led back, one after the other, each in its place: what its pairs move waits until those of the
 * next row have been found. */
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
        if (row < end && has_picture) {
            draw_row(p, row, n_columns);
            find_steps(p, row);
        }
        if (row > first && row <= end && has_picture)
            move_between(p, row - 1, 0);
        if (row - 2 >= taken && row - 2 < taken_end) {
            const double found = finish_row(p, row - 2);
            sum += row - 2 >= view->first_row && row - 2 < view->end_row ? found : 0.0;
            if (is_back && row - 2 >= view->first_row)
                pull_pairs(p, row - 2);
        }
        if (is_back && row - 3 >= view->first_row && row - 3 < taken_end)
            move_between(p, row - 3, 1);
        if (is_back && row - ROWS_WAITING >= view->first_row)
            pull_row(p, row - ROWS_WAITING, n_columns);
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
        list_met_pairs(&p);
    switch (l->n_columns) {
    case 1: sum = pass_rows(&p, 1); break;
    case 3: sum = pass_rows(&p, 3); break;
    default: sum = pass_rows(&p, l->n_columns);
    }
    if (l->out)
        forget_band(l->faces);
    else
        close_faces(&p);
    return sum;
}

#endif
