/* Census: counts the triangles that each part of the drawing code would draw, where it decides.
 * In: the decisions of raster.c and single_fixed.c.  Out: tl_census. */
#ifndef TL_CENSUS_C
#define TL_CENSUS_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "vertex/setup.c"

/* The sink that triangles are drawn for, or counted for. */
TL_INLINE tl_sink sink_of(const tl_target *target, tl_sink sink)
{
    return sink == TL_SINK_CENSUS ? target->census->sink : sink;
}

/* The functions below do nothing for all sinks but the census, so that drawing code has no test for it. */

/* Counts triangles that are degenerate or culled. */
TL_INLINE void count_faceless(const tl_target *target, tl_sink sink, vm m, vi area)
{
    if (sink != TL_SINK_CENSUS)
        return;
    tl_census *census = target->census;
    const vm is_flat = vm_and(m, vi_eq(area, vi_set1(0)));
    census->n[TL_CLASS_DEGENERATE] += __builtin_popcount(vm_bits(is_flat));
    census->n[TL_CLASS_CULLED] += __builtin_popcount(vm_bits(vm_and_not(m, is_flat)));
}

/* Counts triangles with an empty box; side: the shorter side of the box before clipping to the window. */
TL_INLINE void count_unseen(const tl_target *target, tl_sink sink, vm m, vi side)
{
    if (sink != TL_SINK_CENSUS)
        return;
    tl_census *census = target->census;
    const vm is_outside = vm_and(m, vi_gt(side, vi_set1(0)));
    census->n[TL_CLASS_OUTSIDE] += __builtin_popcount(vm_bits(is_outside));
    census->n[TL_CLASS_BETWEEN] += __builtin_popcount(vm_bits(vm_and_not(m, is_outside)));
}

static inline void count_box(tl_census *census, tl_class k, double n_samples, double area_px)
{
    census->n[k]++;
    census->boxes[k] += n_samples;
    census->covered[k] += area_px < n_samples ? area_px : n_samples;
}

/* Counts triangles that lanes draw; doubled_area in square units. */
static void count_boxes(tl_census *census, const vm *classes, vi n_cols, vi n_rows, vi doubled_area, int bits)
{
    int32_t cols[TL_MAX_LANES], rows[TL_MAX_LANES], areas[TL_MAX_LANES];
    const double unit = 0.5 / (double)((int64_t)1 << 2 * bits);
    vi_store(cols, n_cols), vi_store(rows, n_rows), vi_store(areas, doubled_area);
    for (int k = 0; k < 4; k++)
        for (unsigned lanes = vm_bits(classes[k]); lanes; lanes &= lanes - 1) {
            const int lane = __builtin_ctz(lanes);
            count_box(census, (tl_class)(TL_CLASS_TINY + k), (double)cols[lane] * rows[lane], areas[lane] * unit);
        }
}

/* Counts a triangle that is degenerate or culled. */
TL_INLINE void count_faceless_one(const tl_target *target, tl_sink sink, int sign)
{
    if (sink == TL_SINK_CENSUS)
        target->census->n[sign ? TL_CLASS_CULLED : TL_CLASS_DEGENERATE]++;
}

/* Counts a triangle whose box in the window is empty. */
TL_INLINE void count_unseen_one(const tl_target *target, tl_sink sink, const tl_triangle *t, const tl_window *window)
{
    if (sink != TL_SINK_CENSUS)
        return;
    const extent_rounding round = round_extent(window);
    const int64_t x0 = min3(t->x_fx[0], t->x_fx[1], t->x_fx[2]), x1 = max3(t->x_fx[0], t->x_fx[1], t->x_fx[2]);
    const int64_t y0 = min3(t->y_fx[0], t->y_fx[1], t->y_fx[2]), y1 = max3(t->y_fx[0], t->y_fx[1], t->y_fx[2]);
    const int bits = window->subpixel_bits;
    const int is_empty = (x0 + round.first) >> bits >= (x1 + round.end) >> bits ||
                         (y0 + round.first) >> bits >= (y1 + round.end) >> bits;
    target->census->n[is_empty ? TL_CLASS_BETWEEN : TL_CLASS_OUTSIDE]++;
}

static inline void count_one(tl_census *census, tl_class walker, const tl_triangle *t, int bits)
{
    const double area_px = i128_to_f64(weight_sum(t)) * 0.25 / (double)((int64_t)1 << 2 * bits);
    count_box(census, walker, (double)(t->col1 - t->col0) * (double)(t->row1 - t->row0), area_px);
}

#endif
