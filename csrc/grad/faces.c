/* The contents of a band, for forward and backward: runs of pixels, faces, pairs of pixels with an edge between.
 * In: ids of a picture, a mesh with attributes.  Out: runs, faces, pairs.
 *
 * A visible triangle is a face.  It has planes in float64, relative to the first pixel that shows it and in units of
 * its total there; attributes at pixels are their quotients.  It has room for the sums of colors.c. */
#ifndef TL_GRAD_FACES_C
#define TL_GRAD_FACES_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "grad/edges.c"
#include "grad/grad.h"
#include "grad/pixels.h"
#include "grad/points.c"
#include "lanes/lanes.h"
#include "lanes/quads.h"

/* Planes of a face: by column, by row, and at its first pixel; four numbers each.  Where FACE_REST is above 0 the sum
 * of the weights is below 1.  Then column and row of that pixel; and for each three attributes their planes, their
 * values at the last corner, and as many sums as planes. */
enum { FACE_U, FACE_V, FACE_ZW, FACE_REST, FACE_TOTAL = FACE_REST, FACE_PLANE = 12, FACE_COLUMN = 12, FACE_ROW };
enum { FACE_QUADS = 4 * 4, THREE_LAST = FACE_PLANE, THREE_SUMS = FACE_QUADS };

/* A band with the rows on either side of it that its edges reach: runs of pixels of equal id, faces, pairs. */
typedef struct {
    const tl_grad_view *view;
    tl_grad_picture *l;
    tl_grad_view all;                        /* the band and those rows */
    int32_t *faces;                          /* of runs: twice the face, 1 more where clamped, less than 0 for none */
    int32_t *corners[3], *column, *row, *id; /* of faces */
    tl_met_pair *pairs;
    float *rows; /* TL_ROWS_KEPT rows from `base` on: colours, which become gradients */
    int64_t base;
    double *moves[2][2]; /* forward, backward; of even and odd rows: added to the near pixel, subtracted from the far */
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

/* Makes the face of a triangle that has no face, at the first pixel that shows it; -1 if its corners do not exist. */
TL_INLINE int32_t make_face(picture_pass *p, int32_t id, int32_t column, int64_t row)
{
    const tl_grad_view *view = p->view;
    const int64_t n_rows = p->l->n_attr < view->n_vertices ? p->l->n_attr : view->n_vertices;
    if (!has_corners(view, n_rows, id))
        return -1;
    const int32_t face = p->l->faces->slot_of[id] = (int32_t)p->l->faces->n++;
    p->l->faces->rows[face] = id;
    for (int k = 0; k < 3; k++)
        p->corners[k][face] = view->tri[3 * (int64_t)id + k];
    p->column[face] = column, p->row[face] = (int32_t)row, p->id[face] = id;
    return face;
}

/* Lists where the runs of a row begin; returns how many.  Ids that are no triangle's form runs, too. */
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
        before = id;
        if (!vm_any(starts)) /* background, mostly */
            continue;
        n += vi_compress(begins + n, starts, vi_add(vi_iota(), vi_set1((int32_t)x)));
    }
    return n;
}

/* Sets the faces of the runs of a row from `first` on; makes faces of triangles without a face. */
TL_INLINE void find_faces(picture_pass *p, const int32_t *ids, int64_t row, int64_t first, int64_t n_runs)
{
    const vi none = vi_set1(-1), end = vi_set1(clamped_to_int(p->view->n_triangles));
    int32_t id[TL_MAX_LANES];
    for (int64_t r = first; r < n_runs; r += TL_LANES) {
        const vm m = vm_first(n_runs - r);
        const vi shown = vi_gather(m, ids, vi_load(p->l->begins + r));
        const vm is_there = vm_and(m, vm_and(vi_gt(shown, none), vi_gt(end, shown)));
        const vi face = vi_select(is_there, vi_gather(is_there, p->l->faces->slot_of, shown), none);
        vi_store(p->faces + r, vi_add(face, face)); /* runs beyond n_runs are set later */
        vi_spill(id, shown);
        for (unsigned made = vm_bits(vm_and(is_there, vi_gt(vi_set1(0), face))); made; made &= made - 1) {
            const int k = __builtin_ctz(made);
            const int32_t slot = p->l->faces->slot_of[id[k]]; /* a run before in this vector has the face */
            p->faces[r + k] = 2 * (slot >= 0 ? slot : make_face(p, id[k], p->l->begins[r + k], row));
        }
    }
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
        find_faces(p, ids, row, first, n_runs);
    }
    p->l->row_runs[p->all.end_row - p->all.first_row] = n_runs;
    for (int k = 0; k < TL_IDS_ROOM; k++) {
        const int64_t at = p->l->faces->n + k;
        p->corners[0][at] = p->corners[1][at] = p->corners[2][at] = p->column[at] = p->row[at] = 0;
    }
    p->l->n_faces = p->l->faces->n;
}

/* Restores the faces of the forward pass. */
static void take_faces(const picture_pass *p)
{
    tl_grad_sums *faces = p->l->faces;
    for (faces->n = 0; faces->n < p->l->n_faces; faces->n++)
        faces->rows[faces->n] = p->id[faces->n];
}

/* Sets planes of TL_LANES faces: of the weights, of z/w and of the total. */
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

/* The numbers of a face; and the offset of its numbers for three attributes from `first` on. */
TL_INLINE double *face_at(const picture_pass *p, int64_t face)
{
    return p->l->faces->sums + face * p->l->faces->n_columns;
}
TL_INLINE int64_t place_of_three(int64_t first) { return TL_HEAD_OF_FACE + first / 3 * TL_SUMS_OF_FACE; }

/* Stores quads of lanes into faces. */
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

/* Sets the planes of three attributes minus their value at the last corner; that value follows. */
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

/* Whether the second pixel of a pair is nearer. */
TL_INLINE int is_nearer_at(const picture_pass *p, const tl_pair_list *list, int64_t i)
{
    const int in_column = list->where[i] & TL_IN_COLUMN;
    const int64_t x = list->column[i], row = list->where[i] >> TL_ROW_SHIFT;
    return list->near[i] < 0 || (list->far[i] >= 0 && (float)zw_at(p, list->far[i], x + !in_column, row + in_column) <
                                                          (float)zw_at(p, list->near[i], x, row));
}

/* Lists the pairs of all rows: those with the row below, then those within a row. */
static void list_row_pairs(const picture_pass *p)
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
        orient_pairs(&list);
        const int64_t n_met = list_pairs(p->view, &p->l->edges, &list, which);
        for (int64_t i = 0; i < n_met; i += TL_LANES) {
            const int64_t end = n + find_pairs(p->view, &p->l->edges, &list, which + i, n_met - i, p->pairs + n);
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

#endif
