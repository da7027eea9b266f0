/* Parts of rows in lanes: runs of pixels that show one triangle.  Pixels load the numbers of their run by a load and a
 * permutation.
 * In: ids of pixels, triangles.  Out: runs, the corners of their triangles.
 *
 * Numbers are float32.  A run ends with its span, and spans begin at multiples of TL_GRAD_SPAN: no result depends on
 * the number of lanes.  Vectors of four numbers a pixel are loaded and stored in memory order; lane k then has pixel
 * vi_quad_slot(k).
 *
 * Based on: C. A. Burns and W. A. Hunt, The Visibility Buffer, 2013. */
#ifndef TL_GRAD_SPANS_H
#define TL_GRAD_SPANS_H

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "grad/grad.h"
#include "grad/pixels.h"
#include "lanes/lanes.h"
#include "lanes/quads.h"

#define TL_GRAD_SPAN 256 /* pixels */
#define TL_GRAD_ROOM (TL_GRAD_SPAN + 2 * TL_MAX_LANES)
#define TL_RUN_NUMBERS 12
#define TL_SUMMED 16 /* summed in float32; their sums are added in float64 */

/* Runs of the pixels of a span; background has id -1.  Run r begins at pixel begins[r] of the span. */
typedef struct {
    int64_t row, first; /* row of the picture, column of the first pixel */
    int n, n_runs;
    int64_t bad_id;                /* see pixel_run */
    int before[TL_GRAD_SPAN];      /* of each vector: the number of runs that begin before it */
    unsigned starts[TL_GRAD_SPAN]; /* of each vector: bits of the lanes where runs begin */
    _Alignas(64) int32_t ids[TL_GRAD_ROOM];
    _Alignas(64) int32_t begins[TL_GRAD_ROOM];
    _Alignas(64) int32_t corners[3][TL_GRAD_ROOM];
    _Alignas(64) float numbers[TL_RUN_NUMBERS][TL_GRAD_ROOM];
    _Alignas(64) float planes[2][4 * TL_GRAD_ROOM]; /* at quad_of_run: values at the first pixel, and steps */
    _Alignas(64) double inverses[TL_GRAD_ROOM];
} grad_span;

/* The source of ids: rows of ids, to which first_id is added; or `rast`, unless it is NULL. */
typedef struct {
    const int32_t *lowest;
    int64_t step, first_id;
    const float *rast;
} id_rows;

/* The pixels of a vector in a span, and the run of each lane. */
typedef struct {
    const grad_span *span;
    int x, n; /* the first pixel; how many, at most TL_LANES */
    int first;
    vi run, pixel; /* pixel: 0, 1, 2 and so on, or in the order of quads */
    vm is_shown;
} span_lanes;

TL_INLINE vi order_of_quads(void)
{
    int32_t slots[TL_MAX_LANES];
    for (int k = 0; k < TL_LANES; k++)
        slots[k] = vi_quad_slot(k);
    return vi_load(slots);
}

/* The ids of TL_LANES pixels of `rast`, -1 for none. */
TL_INLINE vi ids_of_numbers(vf number)
{
    const vf last = vf_set1((float)TL_LAST_EXACT_ID);
    vi id = vi_sub(vi_floor(vf_min(number, last)), vi_set1(1));
    id = vi_select(vf_lt(last, number), vi_add(vi_bits_of_vf(number), vi_set1(TL_LAST_EXACT_ID - TL_BITS_OF_LAST - 1)),
                   id);
    return vi_select(vf_ge(number, vf_set1(1.0f)), id, vi_set1(-1));
}

/* Copies n rows of k numbers. */
TL_INLINE void copy_rows(float *to, const float *from, int n, int k)
{
    if (n > 0)
        memcpy(to, from, (size_t)(n * k) * sizeof *to);
}

/* Loads n <= TL_LANES rows of `stride` numbers as columns; other lanes are 0. */
TL_INLINE void load_some_columns(const float *p, int stride, int n, vf *columns)
{
    float some[4 * TL_MAX_LANES + 4];
    if (stride == 1 || n < TL_LANES || TL_LANES == 1) {
        memset(some, 0, sizeof some);
        copy_rows(some, p, n, stride);
        p = some;
    }
    if (stride == 1)
        columns[0] = vf_load(p);
    else
        load_columns_f32(p, stride, columns);
}

/* Loads n <= TL_LANES rows of four numbers as columns, in the order of quads; `store_some_quads` writes them back. */
TL_INLINE void load_some_quads(const float *p, int n, vf *columns)
{
    float some[4 * TL_MAX_LANES];
    vi bits[4];
    if (n < TL_LANES) {
        memset(some, 0, sizeof some);
        copy_rows(some, p, n, 4);
        p = some;
    }
    vi_load_quads((const int32_t *)p, bits);
    for (int k = 0; k < 4; k++)
        columns[k] = vf_of_bits(bits[k]);
}
TL_INLINE void store_some_quads(float *p, int n, const vf *columns)
{
    float some[4 * TL_MAX_LANES];
    vi bits[4];
    for (int k = 0; k < 4; k++)
        bits[k] = vi_bits_of_vf(columns[k]);
    if (n == TL_LANES) {
        vi_store_quads((int32_t *)p, bits);
        return;
    }
    vi_store_quads((int32_t *)some, bits);
    copy_rows(p, some, n, 4);
}

/* Lists the runs of a span. */
TL_INLINE void list_span_runs(grad_span *s, const tl_grad_view *view, const id_rows *from)
{
    const float *rast = from->rast ? from->rast + 4 * (s->row * view->width + s->first) : 0;
    const int32_t *ids = rast ? 0 : from->lowest + from->step * s->row + s->first;
    const vi none = vi_set1(-1);
    vi before = vi_set1(INT32_MIN);
    s->n_runs = 0;
    for (int x = 0, i = 0; x < s->n; x += TL_LANES, i++) {
        const int n = s->n - x < TL_LANES ? s->n - x : TL_LANES;
        const vm inside = vm_first(n);
        vi id;
        if (rast) {
            vf columns[4];
            load_some_columns(rast + 4 * x, 4, n, columns);
            id = ids_of_numbers(columns[3]);
        } else {
            id = n < TL_LANES ? vi_load_masked(inside, ids + x) : vi_load(ids + x);
            id = vi_select(vi_gt(id, none), vi_add(id, vi_set1((int32_t)from->first_id)), none);
        }
        const vm starts = vm_and_not(inside, vi_eq(id, vi_shift_in(id, before)));
        vi_compress(s->ids + s->n_runs, starts, id);
        vi_compress(s->begins + s->n_runs, starts, vi_add(vi_iota(), vi_set1(x)));
        s->before[i] = s->n_runs, s->starts[i] = vm_bits(starts);
        s->n_runs += __builtin_popcount(vm_bits(starts));
        before = id;
    }
    s->begins[s->n_runs] = s->n;
}

/* Sets the corners of runs; runs of a triangle without rows below n_rows become background. */
TL_INLINE void find_corners(grad_span *s, const int32_t *triangles, int64_t n_triangles, int64_t n_rows)
{
    const vi none = vi_set1(-1), end = vi_set1(clamped_to_int(n_triangles)), rows = vi_set1(clamped_to_int(n_rows));
    for (int r = 0; r < s->n_runs; r += TL_LANES) {
        const vi id = vi_load(s->ids + r), id_3 = vi_add(id, vi_add(id, id));
        const vm wanted = vm_and(vm_first(s->n_runs - r), vm_and_not(vm_all(), vi_eq(id, none)));
        vm found = vm_and(wanted, vm_and(vi_gt(id, none), vi_gt(end, id)));
        for (int k = 0; k < 3; k++) {
            const vi corner = vi_gather(found, triangles + k, id_3);
            found = vm_and(found, vi_gt_unsigned(rows, corner));
            vi_store(s->corners[k] + r, corner);
        }
        for (int k = 0; k < 3; k++) /* lanes without a triangle are read, too */
            vi_store(s->corners[k] + r, vi_select(found, vi_load(s->corners[k] + r), vi_set1(0)));
        if (vm_any(vm_and_not(wanted, found)))
            for (int k = 0; k < TL_LANES; k++)
                if (vm_bits(vm_and_not(wanted, found)) >> k & 1)
                    s->bad_id = s->ids[r + k];
        vi_store(s->ids + r, vi_select(found, id, none));
    }
}

/* The state before the first span of a band. */
#define TL_BEFORE_SPANS(view) {.row = (view)->first_row - 1, .first = (view)->width, .bad_id = -1}

/* Steps to the next span of a band and sets its runs and their corners, rows below n_rows; 0 at the end. */
TL_INLINE int next_grad_span(const tl_grad_view *view, const id_rows *ids, int64_t n_rows, grad_span *s)
{
    s->first += s->n;
    if (s->first >= view->width)
        s->first = 0, s->row++;
    if (s->row >= view->end_row || view->width == 0)
        return 0;
    s->n = view->width - s->first < TL_GRAD_SPAN ? (int)(view->width - s->first) : TL_GRAD_SPAN;
    list_span_runs(s, view, ids);
    find_corners(s, view->tri, view->n_triangles, n_rows);
    return 1;
}

/* The pixels of vector i; is_quads: in the order of quads. */
TL_INLINE span_lanes lanes_of_span(const grad_span *s, int i, vi pixel, int is_quads)
{
    const unsigned starts = s->starts[i];
    const int begins = (int)(starts & 1);
    span_lanes p = {.span = s, .x = i * TL_LANES, .first = s->before[i] - 1 + begins, .pixel = pixel};
    int32_t runs[TL_MAX_LANES];
    p.n = s->n - p.x < TL_LANES ? s->n - p.x : TL_LANES;
    p.run = vi_sub(vi_prefix_count(starts), vi_set1(begins));
    if (is_quads && TL_LANES > 1) {
        vi_store(runs, p.run);
        p.run = vi_pick(runs, pixel);
    }
    p.is_shown = vi_gt(vi_pick(s->ids + p.first, p.run), vi_set1(-1));
    return p;
}

TL_INLINE vf pick_number(const span_lanes *p, int k) { return vf_pick(p->span->numbers[k] + p->first, p->run); }

/* Distances of pixels from the first pixel of their run. */
TL_INLINE vf from_begin(const span_lanes *p)
{
    return vf_from_vi(vi_sub(vi_add(p->pixel, vi_set1(p->x)), vi_pick(p->span->begins + p->first, p->run)));
}

/* A run of a span. */
TL_INLINE pixel_run run_of_span(const tl_grad_view *view, const grad_span *s, int r)
{
    const int64_t column = s->first + s->begins[r];
    return (pixel_run){.id = s->ids[r],
                       .row = s->row,
                       .column = column,
                       .at = s->row * view->width + column,
                       .n = s->begins[r + 1] - s->begins[r]};
}

/* The position of the quads of a run. */
TL_INLINE int quad_of_run(int r) { return 4 * (r / TL_LANES * TL_LANES + vi_quad_slot(r % TL_LANES)); }

/* Sets the quads of runs from r on. */
TL_INLINE void set_quads(grad_span *s, int plane, int r, const vf *columns)
{
    vi bits[4];
    for (int k = 0; k < 4; k++)
        bits[k] = vi_bits_of_vf(columns[k]);
    vi_store_quads((int32_t *)s->planes[plane] + 4 * r, bits);
}

/* A plane along a run, from its first pixel on; `last`: its last number, four times. */
typedef struct {
    vq4 begin, step;
    vq last, last_step;
} run_plane;

TL_INLINE run_plane run_plane_of(vq begin, vq step)
{
    return (run_plane){vq4_all(begin), vq4_all(step), vq_set1(begin[3]), vq_set1(step[3])};
}
TL_INLINE run_plane plane_of_run(const grad_span *s, int r)
{
    const int at = quad_of_run(r);
    return run_plane_of(vq_load(s->planes[0] + at), vq_load(s->planes[1] + at));
}

/* Distances of four pixels from the first pixel of their run: in all lanes of their quads, and a lane a pixel. */
typedef struct {
    vq4 quads;
    vq each;
} run_columns;

TL_INLINE run_columns columns_from(int x)
{
    const run_columns columns = {vq4_pixels(), {0.0f, 1.0f, 2.0f, 3.0f}};
    if (x == 0) /* constants when x is known */
        return columns;
    return (run_columns){vq4_add(columns.quads, vq4_set1((float)x)), columns.each + vq_set1((float)x)};
}
TL_INLINE void next_columns(run_columns *columns)
{
    columns->quads = vq4_add(columns->quads, vq4_set1(4.0f));
    columns->each += vq_set1(4.0f);
}
TL_INLINE vq4 plane_at_pixels(const run_plane *p, const run_columns *columns)
{
    return vq4_add(p->begin, vq4_mul(p->step, columns->quads));
}
/* 1 / the last number of the plane at each pixel: a division of four numbers, not of sixteen. */
TL_INLINE vq4 inverse_at_pixels(const run_plane *p, const run_columns *columns)
{
    return vq4_spread(vq_set1(1.0f) / (p->last + p->last_step * columns->each));
}

#endif
