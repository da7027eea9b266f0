/* Viewsheds: the height above the ground of each cell at which a line of sight from one point passes.
 * In: heights at the centres of cells, a point.  Out: heights above the ground, 0 where the ground is visible.
 *
 * The line to each cell is tested by itself, against every line between the centres of neighbours, along rows and along
 * columns, with heights interpolated between them.  Blocks below the slope that already hides the cell are skipped.
 *
 * Based on: W. R. Franklin, C. K. Ray, Higher Isn't Necessarily Better: Visibility Algorithms and Experiments, 1994
 * (R3, along both axes). */
#ifndef TL_VIEWSHED_C
#define TL_VIEWSHED_C

#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "grid/grid.h"

TL_INLINE double max_of(double a, double b) { return a > b ? a : b; }
TL_INLINE double min_of(double a, double b) { return a < b ? a : b; }

/* A line of sight from the eye to the centre of a cell; `along` is the axis in which it is longer, `across` the
 * other. */
typedef struct {
    const double *ways, *other_ways; /* 1 / (k - eye) along, and across */
    double from, to, from_across, to_across, low, high;
    double slope, share, way, across_way; /* d across / d along; 1 / way; to - from */
    int64_t stride, across_stride, blocks, across_blocks;
    double fall;
} sight;

/* The slope from the eye to a height, at a share of the line; `per` is 1 / share. */
TL_INLINE double way_up(double height, double eye, double per, double fall, double share)
{
    return (height - eye) * per - fall * share;
}

/* The height at `place`, interpolated between two neighbours `stride` apart. */
TL_INLINE double height_between(const double *heights, double place, int64_t stride)
{
    const int64_t line = (int64_t)place;
    const double w = place - (double)line, *const z = heights + line * stride;
    return w > 0.0 ? z[0] + w * (z[stride] - z[0]) : z[0];
}

/* The steepest slope over the lines between centres that a part of a line of sight crosses: lines [first, end) of the
 * axis along, and lines across from `low` to `high`. */
static double steepest(const tl_terrain *t, const sight *s, int64_t first, int64_t end, double low, double high,
                       double most)
{
    for (int64_t k = first; k < end; k++) {
        const double at = (double)k - s->from, exact = s->from_across + at * s->slope;
        const double across = exact < s->low ? s->low : exact > s->high ? s->high : exact; /* for rounding */
        const double height = height_between(t->heights + k * s->stride, across, s->across_stride);
        const double up = way_up(height, t->eye[2], s->way * s->ways[k], s->fall, at * s->share);
        most = up > most ? up : most;
    }
    if (s->across_way == 0.0)
        return most;
    const double least = s->from < s->to ? s->from : s->to, greatest = s->from < s->to ? s->to : s->from;
    for (int64_t k = (int64_t)ceil(low); k <= (int64_t)floor(high); k++) {
        if ((double)k <= s->low || (double)k >= s->high) /* in line with the eye or the cell */
            continue;
        const double part = ((double)k - s->from_across) / s->across_way, exact = s->from + part * s->way;
        const double along = exact < least ? least : exact > greatest ? greatest : exact;
        const double height = height_between(t->heights + k * s->across_stride, along, s->stride);
        const double up = way_up(height, t->eye[2], s->across_way * s->other_ways[k], s->fall, part);
        most = up > most ? up : most;
    }
    return most;
}

/* The greatest height of the blocks that a part of a line may touch, at [low, high] across, in block `block` along. */
static double block_height(const tl_terrain *t, const sight *s, int64_t block, double low, double high)
{
    double most = -INFINITY;
    for (int64_t b = (int64_t)low / TL_VIEW_BLOCK; b <= (int64_t)high / TL_VIEW_BLOCK; b++)
        most = max_of(most, t->blocks[block * s->blocks + b * s->across_blocks]);
    return most;
}

/* The steepest slope over all of a line, block by block from the eye on; most blocks lie below the slope so far. */
static double follow(const tl_terrain *t, const sight *s)
{
    double most = -INFINITY;
    const double least = s->from < s->to ? s->from : s->to, greatest = s->from < s->to ? s->to : s->from;
    const int64_t first = (int64_t)floor(least) + 1, end = (int64_t)ceil(greatest);
    const int64_t near = (int64_t)s->from / TL_VIEW_BLOCK, far = (int64_t)s->to / TL_VIEW_BLOCK;
    const int64_t step = s->way < 0.0 ? -1 : 1;
    for (int64_t block = near; block != far + step; block += step) {
        const double begin = max_of((double)(block * TL_VIEW_BLOCK), least);
        const double stop = min_of((double)((block + 1) * TL_VIEW_BLOCK), greatest);
        const double one = s->from_across + (begin - s->from) * s->slope;
        const double other = s->from_across + (stop - s->from) * s->slope;
        const double low = max_of(min_of(one, other), s->low), high = min_of(max_of(one, other), s->high);
        const double above = block_height(t, s, block, low, high) - t->eye[2];
        const double part = fabs((above > 0.0) == (s->way > 0.0) ? begin - s->from : stop - s->from);
        if (s->fall >= 0.0 && above * fabs(s->way) <= most * part * (most > 0.0 ? 1.0 - 0x1p-40 : 1.0 + 0x1p-40))
            continue;
        const int64_t k = block * TL_VIEW_BLOCK;
        most =
            steepest(t, s, k > first ? k : first, k + TL_VIEW_BLOCK < end ? k + TL_VIEW_BLOCK : end, low, high, most);
    }
    return most;
}

static double steepest_to(const tl_terrain *t, double to_x, double to_y, double fall)
{
    const double x = t->eye[0], y = t->eye[1], dx = to_x - x, dy = to_y - y;
    sight s;
    if (dx == 0.0 && dy == 0.0)
        return -INFINITY;
    const int by_row = fabs(dy) > fabs(dx);
    s.ways = t->ways[by_row], s.other_ways = t->ways[!by_row];
    s.from = by_row ? y : x, s.to = by_row ? to_y : to_x;
    s.from_across = by_row ? x : y, s.to_across = by_row ? to_x : to_y;
    s.low = min_of(s.from_across, s.to_across), s.high = max_of(s.from_across, s.to_across);
    s.way = s.to - s.from, s.across_way = s.to_across - s.from_across;
    s.slope = s.across_way / s.way, s.share = 1.0 / s.way;
    s.stride = by_row ? t->width : 1, s.across_stride = by_row ? 1 : t->width;
    s.blocks = by_row ? t->n_blocks : 1, s.across_blocks = by_row ? 1 : t->n_blocks;
    s.fall = fall;
    return follow(t, &s);
}

static void view_heights(const tl_terrain *t, int64_t first, int64_t end, double *out)
{
    const double x = t->eye[0], y = t->eye[1];
    for (int64_t row = first; row < end; row++)
        for (int64_t column = 0; column < t->width; column++) {
            const int64_t i = row * t->width + column;
            const double to_x = (double)column, to_y = (double)row, dx = (to_x - x) * t->cell[0];
            const double dy = (to_y - y) * t->cell[1], squared = dx * dx + dy * dy;
            if (isnan(t->heights[i]) || !(squared <= t->most_squared)) {
                out[i] = TL_NAN;
                continue;
            }
            const double fall = squared * t->curvature, most = steepest_to(t, to_x, to_y, fall);
            const double above = t->eye[2] + most + fall - t->heights[i];
            out[i] = above > 0.0 ? above : 0.0;
        }
}

#endif
