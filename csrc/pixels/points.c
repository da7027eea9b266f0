/* Points: the points in space of the pixels of a visibility buffer, their distances, and their motion in the picture.
 * In: ids, the meshes they were drawn from, positions of their vertices.  Out: float32, or float64, per pixel.
 *
 * A point is interpolated with the weights of its pixel, relative to the first corner: it lies on the triangle.  A
 * number that depends linearly on the point is computed at the corners and interpolated.  All is float64, rounded once
 * at the end. */
#ifndef TL_POINTS_C
#define TL_POINTS_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "pixels/instances.c"
#include "pixels/runs.c"
#include "pixels/shading.h"
#include "pixels/weights.c"

typedef struct {
    weighed_span weighed;
    /* of each row: at the first corner, and differences along the edges to the other corners */
    _Alignas(64) double value[3 * TL_POINT_ROWS][TL_SPAN_ROOM];
    double numbers[3][TL_SPAN_ROOM]; /* of the pixels of the span */
} point_span;

/* Sets the rows at the corners of runs. */
TL_INLINE void set_values(point_span *r, const tl_points *points, const tl_point_mesh *mesh)
{
    const int end = TL_LANES + r->weighed.runs.n_runs;
    for (int slot = TL_LANES; slot < end; slot += TL_LANES) {
        vd p[9];
        for (int k = 0; k < 3; k++)
            load_positions(mesh->positions, mesh->is_f64, r->weighed.corners[k] + slot, p + 3 * k);
        for (int k = 3; k < 9; k++)
            p[k] = vd_sub(p[k], p[k % 3]);
        for (int i = 0; i < points->n_rows; i++)
            for (int k = 0; k < 3; k++) {
                const double *row = mesh->rows[i];
                vd sum = vd_add(vd_mul(vd_set1(row[0]), p[3 * k]), vd_mul(vd_set1(row[1]), p[3 * k + 1]));
                sum = vd_add(sum, vd_mul(vd_set1(row[2]), p[3 * k + 2]));
                vd_store(r->value[3 * i + k] + slot, k ? sum : vd_add(sum, vd_set1(row[3])));
            }
    }
}

/* Projects x, y and w to pixels; NaN unless w > 0. */
TL_INLINE void to_pixels(const tl_points *points, const vd *p, vd *xy)
{
    const vd one = vd_set1(1.0), none = vd_set1(TL_NAN), inverse = vd_div(one, p[2]);
    const vd x = vd_mul(p[0], inverse), y = vd_mul(p[1], inverse);
    const vm is_behind = vd_ge(vd_set1(0.0), p[2]);
    xy[0] = vd_select(is_behind, none, vd_mul(vd_add(x, one), vd_set1(points->half_width_px)));
    xy[1] = vd_select(is_behind, none, vd_mul(vd_sub(one, y), vd_set1(points->half_height_px)));
}

/* Computes the numbers of vector i of a span; returns how many. */
TL_INLINE int make_numbers(const point_span *r, const tl_points *points, int i, vd *out)
{
    const weighed_span *weighed = &r->weighed;
    const vd w1 = vd_load(weighed->w[1] + i * TL_LANES), w2 = vd_load(weighed->w[2] + i * TL_LANES);
    shaded_lanes p;
    vi e[3], sum;
    vd value[TL_POINT_ROWS];
    find_lanes(&p, &weighed->runs, i, 0, e, &sum);
    for (int k = 0; k < points->n_rows; k++) {
        const vd first = vd_pick(r->value[3 * k] + p.first, p.run);
        const vd along = vd_mul(vd_pick(r->value[3 * k + 1] + p.first, p.run), w1);
        value[k] = vd_add(vd_add(first, along), vd_mul(vd_pick(r->value[3 * k + 2] + p.first, p.run), w2));
    }
    if (points->kind == TL_POINT_LENGTH) {
        const vd x = vd_mul(value[0], value[0]), y = vd_mul(value[1], value[1]), z = vd_mul(value[2], value[2]);
        out[0] = vd_sqrt(vd_add(vd_add(x, y), z));
        return 1;
    }
    if (points->kind == TL_POINT_FLOW) {
        vd from[2], to[2];
        to_pixels(points, value, from);
        to_pixels(points, value + 3, to);
        for (int axis = 0; axis < 2; axis++)
            out[axis] = vd_sub(to[axis], from[axis]);
        return 2;
    }
    for (int k = 0; k < points->n_rows; k++)
        out[k] = value[k];
    return points->n_rows;
}

/* Stores the numbers of n pixels of a span from `first` on, all of one mesh, whose runs are set. */
TL_INLINE void set_numbers(point_span *r, const tl_points *points, int n_numbers, int first, int n)
{
    for (int x = 0, i = 0; x < n; x += TL_LANES, i++) {
        const vm visible = vm_from_bits(r->weighed.runs.visible[i]);
        vd numbers[3] = {vd_set1(0.0), vd_set1(0.0), vd_set1(0.0)}; /* for compilers, which cannot see the kind */
        if (!vm_any(visible))
            continue;
        make_numbers(r, points, i, numbers);
        for (int c = 0; c < n_numbers; c++) {
            double *own = r->numbers[c] + first + x;
            vd_store(own, vd_select(visible, numbers[c], vd_load(own)));
        }
    }
}

/* Fills a span of n pixels, instance by instance; the background elsewhere. */
TL_INLINE void fill_span(point_span *r, span_list *list, const tl_points *points, int n_numbers, const int32_t *ids,
                         int64_t row, int64_t column, int n)
{
    for (int c = 0; c < n_numbers; c++)
        for (int x = 0; x < n; x += TL_LANES)
            vd_store(r->numbers[c] + x, vd_set1(points->background));
    list_instances(list, ids, n);
    for (int k = 0; k < list->n; k++) {
        const int first = list->parts[k].first, n_own = list->parts[k].end - first;
        const tl_shaded *own = list->parts[k].instance;
        if (own != list->set) {
            list->set = own;
            weigh_mesh(&r->weighed, own->snapped, own->first_id);
        }
        weigh_span(&r->weighed, ids + first, n_own, row, column + first);
        set_values(r, points, points->meshes + (own - list->scene->instances));
        set_numbers(r, points, n_numbers, first, n_own);
    }
}

/* Writes n pixels. */
TL_INLINE void store_numbers(const point_span *r, int is_f64, int n_numbers, int n, void *out)
{
    for (int x = 0; is_f64 && x < n; x++)
        for (int c = 0; c < n_numbers; c++)
            ((double *)out)[n_numbers * x + c] = r->numbers[c][x];
    for (int x = 0; !is_f64 && x < n; x += TL_LANES) {
        vf rounded[3];
        for (int c = 0; c < n_numbers; c++)
            rounded[c] = vf_from_vd(vd_load(r->numbers[c] + x));
        store_channels((float *)out + n_numbers * x, n_numbers, (int)min64(n - x, TL_LANES), rounded, n_numbers);
    }
}

TL_INLINE void fill_rows(const tl_shaded_scene *scene, const tl_window *window, const tl_points *points, int n_numbers,
                         const int32_t *ids, char *out)
{
    const int64_t pixel_bytes = n_numbers * (points->is_f64_out ? (int64_t)sizeof(double) : (int64_t)sizeof(float));
    point_span r;
    span_list list;
    start_weights(&r.weighed, window);
    start_list(&list, scene);
    memset(r.value, 0, sizeof r.value);
    for (int64_t row = 0; row < window->height; row++)
        for (int64_t column = 0; column < window->width; column += TL_SPAN) {
            const int64_t at = row * window->width + column;
            const int n = (int)min64(TL_SPAN, window->width - column);
            fill_span(&r, &list, points, n_numbers, ids + at, row, column, n);
            store_numbers(&r, points->is_f64_out, n_numbers, n, out + pixel_bytes * at);
        }
}

static void fill_points(const tl_shaded_scene *scene, const tl_window *window, const tl_points *points,
                        const int32_t *ids, void *out)
{
    const int n_numbers = points->kind == TL_POINT_LENGTH ? 1 : points->kind == TL_POINT_FLOW ? 2 : points->n_rows;
    switch (n_numbers) { /* each number has a specialised loop */
    case 1: fill_rows(scene, window, points, 1, ids, out); break;
    case 2: fill_rows(scene, window, points, 2, ids, out); break;
    default: fill_rows(scene, window, points, 3, ids, out);
    }
}

#endif
