/* Points of polygons to fixed point, and the boxes of polygons.
 * In: pixels.  Out: int32 coordinates by column, from the window's corner; int64 coordinates where int32 does not
 * suffice. */
#ifndef TL_POLYGON_POINTS_C
#define TL_POLYGON_POINTS_C

#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "polygons/polygons.h"

/* A coordinate from the window's corner in sub-pixels; 0 when it is not finite or out of range. */
static int snap_exactly(const tl_source *source, int64_t i, int bits, int grid_bits, int64_t corner_px, int64_t *out)
{
    tl_int128 value;
    if (source->scalar == TL_I64) {
        const int64_t v = ((const int64_t *)source->data)[i];
        if (v <= -TL_POLYGON_LIMIT || v >= TL_POLYGON_LIMIT)
            return 0;
        value = i128_shift_left(i128_from(v), grid_bits);
    } else {
        const double v =
            source->scalar == TL_F32 ? (double)((const float *)source->data)[i] : ((const double *)source->data)[i];
        const double fx = rint(v * (double)((int64_t)1 << bits));
        if (!(fabs(fx) < 0x1p61))
            return 0;
        value = i128_shift_left(i128_from((int64_t)fx), grid_bits - bits);
    }
    value = i128_sub(value, i128_shift_left(i128_from(corner_px), grid_bits));
    *out = i128_low(value);
    return i128_less(i128_from(-TL_POLYGON_LIMIT), value) && i128_less(value, i128_from(TL_POLYGON_LIMIT));
}

static void snap_point(const tl_source *source, int64_t i, int bits, int grid_bits, const int64_t *corner_px,
                       int32_t *x_fx, int32_t *y_fx, int64_t *wide_fx, tl_vertex_counts *n)
{
    int64_t x, y;
    const int ok = snap_exactly(source, 2 * i, bits, grid_bits, corner_px[0], &x) &&
                   snap_exactly(source, 2 * i + 1, bits, grid_bits, corner_px[1], &y);
    const int64_t limit = TL_NARROW_POLYGON;
    const int is_narrow = ok && x > -limit && x < limit && y > -limit && y < limit;
    x_fx[i] = is_narrow ? (int32_t)x : INT32_MIN;
    y_fx[i] = is_narrow ? (int32_t)y : 0;
    n->n_bad += !ok;
    n->n_wide += ok && !is_narrow;
    if (wide_fx && ok)
        wide_fx[2 * i] = x, wide_fx[2 * i + 1] = y;
}

/* Snaps one coordinate of TL_LANES points; removes lanes that are not narrow from `narrow`. */
TL_INLINE vi snap_column(vd v, int bits, int grid_bits, double corner_px, vm *narrow)
{
    const vd magic = vd_set1(0x1.8p52); /* adding and subtracting it rounds |fx| < 2^51 to an integer, ties to even */
    const vd fx = vd_mul(v, vd_set1((double)((int64_t)1 << bits)));
    const vd whole = vd_sub(vd_add(fx, magic), magic);
    const vd at = vd_sub(vd_mul(whole, vd_set1((double)((int64_t)1 << (grid_bits - bits)))),
                         vd_set1(corner_px * (double)((int64_t)1 << grid_bits)));
    const vm ok = vm_and(vd_ge(vd_set1(0x1p50), vd_abs(fx)), vd_ge(vd_set1(TL_NARROW_POLYGON - 1), vd_abs(at)));
    *narrow = vm_and(*narrow, ok);
    return vi_round(at);
}

static tl_vertex_counts snap_points(const tl_source *source, int64_t first, int64_t end, int bits, int grid_bits,
                                    const int64_t *corner_px, int32_t *x_fx, int32_t *y_fx, int64_t *wide_fx)
{
    tl_vertex_counts n = {0, 0, 0};
    int64_t i = first;
    const int64_t far = (int64_t)1 << (50 - grid_bits);
    const int is_near = corner_px[0] > -far && corner_px[0] < far && corner_px[1] > -far && corner_px[1] < far;
    if (is_near && source->scalar != TL_I64 && !wide_fx)
        for (; i + TL_LANES + 1 < end; i += TL_LANES) { /* reads two numbers past the last row */
            vm narrow = vm_all();
            vd columns[4];
            if (source->scalar == TL_F64) {
                load_columns_f64((const double *)source->data + 2 * i, 2, columns);
            } else {
                vf singles[4];
                load_columns_f32((const float *)source->data + 2 * i, 2, singles);
                columns[0] = vd_from_vf(singles[0]), columns[1] = vd_from_vf(singles[1]);
            }
            vi_store(x_fx + i, snap_column(columns[0], bits, grid_bits, (double)corner_px[0], &narrow));
            vi_store(y_fx + i, snap_column(columns[1], bits, grid_bits, (double)corner_px[1], &narrow));
            const unsigned all = (unsigned)((1ull << TL_LANES) - 1);
            for (unsigned lanes = all & ~vm_bits(narrow); lanes; lanes &= lanes - 1)
                snap_point(source, i + __builtin_ctz(lanes), bits, grid_bits, corner_px, x_fx, y_fx, NULL, &n);
        }
    for (; i < end; i++)
        snap_point(source, i, bits, grid_bits, corner_px, x_fx, y_fx, wide_fx, &n);
    return n;
}

/* Adds work worth so many pixels of a large triangle; returns whether to give up the call. */
TL_INLINE int is_polygon_given_up(const tl_polygons *s, int64_t n_px)
{
    tl_pause *pause = s->pause;
    if (!pause)
        return 0;
    pause->left_px -= n_px;
    return pause->left_px < 0 && pause->poll(pause);
}

static inline int64_t polygon_x(const tl_polygons *s, int is_wide, int64_t i)
{
    return is_wide ? s->wide_fx[2 * i] : s->x_fx[i];
}
static inline int64_t polygon_y(const tl_polygons *s, int is_wide, int64_t i)
{
    return is_wide ? s->wide_fx[2 * i + 1] : s->y_fx[i];
}

static inline int32_t clamp_px(int64_t a, int64_t high) { return (int32_t)(a < 0 ? 0 : a > high ? high : a); }

static int64_t bound_polygons(const tl_polygons *s, int64_t first, int64_t end, int64_t width, int64_t height,
                              uint8_t *is_wide, tl_polygon_box *boxes)
{
    int64_t most = 0;
    const int64_t up = ((int64_t)1 << s->bits) - 1;
    for (int64_t i = first; i < end; i++) {
        const int64_t a = s->rings[s->polygons[i]], b = s->rings[s->polygons[i + 1]];
        int64_t x0 = INT64_MAX, x1 = INT64_MIN, y0 = INT64_MAX, y1 = INT64_MIN;
        int32_t x_min = INT32_MAX, x_max = INT32_MIN, y_min = INT32_MAX, y_max = INT32_MIN;
        most = b - a > most ? b - a : most;
        for (int64_t k = a; k < b; k++) {
            x_min = s->x_fx[k] < x_min ? s->x_fx[k] : x_min, x_max = s->x_fx[k] > x_max ? s->x_fx[k] : x_max;
            y_min = s->y_fx[k] < y_min ? s->y_fx[k] : y_min, y_max = s->y_fx[k] > y_max ? s->y_fx[k] : y_max;
        }
        is_wide[i] = x_min == INT32_MIN;
        x0 = x_min, x1 = x_max, y0 = y_min, y1 = y_max;
        if (is_wide[i]) {
            x0 = y0 = INT64_MAX, x1 = y1 = INT64_MIN;
            for (int64_t k = a; k < b; k++) {
                const int64_t x = s->wide_fx[2 * k], y = s->wide_fx[2 * k + 1];
                x0 = x < x0 ? x : x0, x1 = x > x1 ? x : x1, y0 = y < y0 ? y : y0, y1 = y > y1 ? y : y1;
            }
        }
        boxes[i] = (tl_polygon_box){0, 0, 0, 0};
        if (a < b)
            boxes[i] = (tl_polygon_box){clamp_px(x0 >> s->bits, width), clamp_px(y0 >> s->bits, height),
                                        clamp_px((x1 + up) >> s->bits, width), clamp_px((y1 + up) >> s->bits, height)};
    }
    return most;
}

static void sort_polygons(const tl_polygon_box *boxes, int64_t n, int64_t band_rows, int64_t n_bands, int64_t *starts,
                          int32_t *listed)
{
    if (!listed) {
        for (int64_t k = 0; k < n_bands + 2; k++)
            starts[k] = 0;
        for (int64_t i = 0; i < n; i++)
            if (boxes[i].top < boxes[i].bottom && boxes[i].left < boxes[i].right)
                for (int64_t k = boxes[i].top / band_rows; k <= (boxes[i].bottom - 1) / band_rows; k++)
                    starts[k + 2]++;
        for (int64_t k = 0; k < n_bands; k++)
            starts[k + 2] += starts[k + 1];
        return;
    }
    for (int64_t i = 0; i < n; i++)
        if (boxes[i].top < boxes[i].bottom && boxes[i].left < boxes[i].right)
            for (int64_t k = boxes[i].top / band_rows; k <= (boxes[i].bottom - 1) / band_rows; k++)
                listed[starts[k + 1]++] = (int32_t)i;
}

#endif
