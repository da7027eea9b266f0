/* Points: where in space the pixels of a visibility buffer lie, their distances, and their ways in the
 * picture.
 * In: ids, the mesh they were drawn from, positions of its vertices.  Out: float32, or float64, of each pixel.
 *
 * A point has the weights of its pixel in its triangle, relative to the first corner: it lies on the triangle.  A
 * number that depends linearly on the point is computed at the corners, and interpolated.  All is float64, rounded once
 * at the end. */
#ifndef TL_POINTS_C
#define TL_POINTS_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "pixels/runs.c"
#include "pixels/weights.c"

typedef struct {
    weighed_span weighed;
    /* of each row at the first corner, and along the edges to the others */
    _Alignas(64) double value[3 * TL_POINT_ROWS][TL_SPAN_ROOM];
} point_span;

/* The rows at the corners of runs. */
TL_INLINE void set_values(point_span *r, const tl_points *points)
{
    const int end = TL_LANES + r->weighed.runs.n_runs;
    for (int slot = TL_LANES; slot < end; slot += TL_LANES) {
        vd p[9];
        for (int k = 0; k < 3; k++)
            load_positions(points->positions, points->is_f64, r->weighed.corners[k] + slot, p + 3 * k);
        for (int k = 3; k < 9; k++)
            p[k] = vd_sub(p[k], p[k % 3]);
        for (int i = 0; i < points->n_rows; i++)
            for (int k = 0; k < 3; k++) {
                const double *row = points->rows[i];
                vd sum = vd_add(vd_mul(vd_set1(row[0]), p[3 * k]), vd_mul(vd_set1(row[1]), p[3 * k + 1]));
                sum = vd_add(sum, vd_mul(vd_set1(row[2]), p[3 * k + 2]));
                vd_store(r->value[3 * i + k] + slot, k ? sum : vd_add(sum, vd_set1(row[3])));
            }
    }
}

/* Where x, y and w lie in the picture. */
TL_INLINE void to_pixels(const tl_points *points, const vd *p, vd *xy)
{
    const vd one = vd_set1(1.0), none = vd_set1(TL_NAN), inverse = vd_div(one, p[2]);
    const vd x = vd_mul(p[0], inverse), y = vd_mul(p[1], inverse);
    const vm is_behind = vd_ge(vd_set1(0.0), p[2]);
    xy[0] = vd_select(is_behind, none, vd_mul(vd_add(x, one), vd_set1(points->half_width_px)));
    xy[1] = vd_select(is_behind, none, vd_mul(vd_sub(one, y), vd_set1(points->half_height_px)));
}

/* The numbers of vector i of a span; returns how many. */
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

/* Writes n pixels of float64. */
static void store_numbers(double *restrict out, int n, const vd *numbers, int n_numbers)
{
    double lanes[TL_MAX_LANES];
    for (int c = 0; c < n_numbers; c++) {
        vd_store(lanes, numbers[c]);
        for (int lane = 0; lane < n; lane++)
            out[lane * n_numbers + c] = lanes[lane];
    }
}

/* A span of n pixels, after its runs. */
TL_INLINE void write_points(point_span *r, const tl_points *points, int n_numbers, int64_t at, int n, void *out)
{
    const vd background = vd_set1(points->background);
    for (int x = 0, i = 0; x < n; x += TL_LANES, i++) {
        const vm visible = vm_from_bits(r->weighed.runs.visible[i]);
        const int n_lanes = (int)min64(n - x, TL_LANES);
        vd numbers[TL_POINT_ROWS];
        vf rounded[3];
        if (vm_any(visible))
            make_numbers(r, points, i, numbers);
        for (int c = 0; c < n_numbers; c++) {
            numbers[c] = vm_any(visible) ? vd_select(visible, numbers[c], background) : background;
            rounded[c] = vf_from_vd(numbers[c]);
        }
        if (points->is_f64_out)
            store_numbers((double *)out + n_numbers * (at + x), n_lanes, numbers, n_numbers);
        else
            store_channels((float *)out + n_numbers * (at + x), n_numbers, n_lanes, rounded, n_numbers);
    }
}

static void fill_points(const tl_snapped *snapped, const tl_window *window, const tl_points *points, const int32_t *ids,
                        void *out)
{
    point_span r;
    start_weights(&r.weighed, snapped, window);
    memset(r.value, 0, sizeof r.value);
    for (int64_t row = 0; row < window->height; row++)
        for (int64_t column = 0; column < window->width; column += TL_SPAN) {
            const int64_t at = row * window->width + column;
            const int n = (int)min64(TL_SPAN, window->width - column);
            weigh_span(&r.weighed, ids + at, n, row, column);
            set_values(&r, points);
            switch (points->kind) { /* so that each has a loop of its own */
            case TL_POINT_LENGTH: write_points(&r, points, 1, at, n, out); break;
            case TL_POINT_FLOW: write_points(&r, points, 2, at, n, out); break;
            default:
                if (points->n_rows == 1)
                    write_points(&r, points, 1, at, n, out);
                else
                    write_points(&r, points, 3, at, n, out);
            }
        }
}

#endif
