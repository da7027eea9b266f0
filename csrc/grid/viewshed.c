/* Viewsheds: how high above the ground of each cell a line of sight from one point passes.
 * In: heights at the middles of cells, a point.  Out: heights above the ground, 0 where the ground is seen.
 *
 * The line to each cell is followed by itself, over every line between the middles of neighbours, along rows and along
 * columns, where the height is between theirs.
 *
 * Based on: W. R. Franklin, C. K. Ray, Higher Isn't Necessarily Better: Visibility Algorithms and Experiments, 1994
 * (R3, along both axes). */
#ifndef TL_VIEWSHED_C
#define TL_VIEWSHED_C

#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"

/* The steepest way up from the eye over the lines across one axis: (height - eye) / t, t from 0 at the eye to 1.
 * Heights lie `stride` apart along the axis and `other` across; a NaN hides nothing.  `ways`: 1 / (k - from) for each
 * line k. */
static double steepest(const tl_terrain *t, const double *ways, double from, double to, double from_other,
                       double to_other, int64_t stride, int64_t other, double fall, double most)
{
    const double way = to - from;
    if (way == 0.0)
        return most;
    const int64_t first = (int64_t)floor(from < to ? from : to) + 1;
    const int64_t end = (int64_t)ceil(from < to ? to : from); /* neither the eye nor the cell */
    const double slope = (to_other - from_other) / way, share = 1.0 / way;
    const double left = from_other < to_other ? from_other : to_other;
    const double right = from_other < to_other ? to_other : from_other;
    for (int64_t k = first; k < end; k++) {
        const double at = (double)k - from, exact = from_other + at * slope;
        const double across = exact < left ? left : exact > right ? right : exact; /* rounding leaves no grid */
        const int64_t line = (int64_t)across;
        const double w = across - (double)line;
        const double *const z = t->heights + k * stride + line * other;
        const double height = w > 0.0 ? z[0] + w * (z[other] - z[0]) : z[0];
        const double up = (height - t->eye[2]) * (way * ways[k]) - fall * (at * share);
        most = up > most ? up : most;
    }
    return most;
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
            const double fall = squared * t->curvature;
            double most = -INFINITY;
            most = steepest(t, t->ways[0], x, to_x, y, to_y, 1, t->width, fall, most);
            most = steepest(t, t->ways[1], y, to_y, x, to_x, t->width, 1, fall, most);
            const double above = t->eye[2] + most + fall - t->heights[i];
            out[i] = above > 0.0 ? above : 0.0;
        }
}

#endif
