/* Spans: the windows of a raster that each triangle may touch, a span of windows for each row of windows.
 * In: corners in pixels, before the snap.  Out: spans sorted by rows of windows, by index within a row.
 *
 * A span may have windows too many, never too few: the box of a triangle is widened by TL_SPAN_MARGIN_PX, which is more
 * than the snap can move a vertex (half a pixel at most) plus a pixel's square.  A triangle of more than one row and
 * column of windows is cut by each row, so that a long thin triangle is not listed in all of its box.  The point where
 * an edge enters a row is computed in float64: its error is below 2^-49 of the largest coordinate, and TL_SPAN_SLACK of
 * it is added. */
#ifndef TL_SPANS_C
#define TL_SPANS_C

#include <float.h>
#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "tiles/tiles.h"

#define TL_SPAN_MARGIN_PX 2.0
#define TL_SPAN_SLACK 0x1p-44

/* Sets the windows [*first, *end) of `side` pixels each that the pixels from low to high touch.  A product with the
 * reciprocal replaces the division: its error of less than 2^-20 px is within the margin. */
static inline void windows_between(double low, double high, int64_t length_px, double per_px, int32_t *first,
                                   int32_t *end)
{
    const double last = (double)(length_px - 1);
    double from = low - TL_SPAN_MARGIN_PX, to = high + TL_SPAN_MARGIN_PX;
    *first = *end = 0;
    if (to < 0.0 || from > last || length_px == 0)
        return;
    from = from < 0.0 ? 0.0 : from;
    to = to > last ? last : to;
    *first = (int32_t)(from * per_px);
    *end = (int32_t)(to * per_px) + 1;
}

/* fmin and fmax, which handle NaN, are calls. */
static inline double min_f64(double a, double b) { return a < b ? a : b; }
static inline double max_f64(double a, double b) { return a > b ? a : b; }
static inline double min3_f64(double a, double b, double c) { return min_f64(a, min_f64(b, c)); }
static inline double max3_f64(double a, double b, double c) { return max_f64(a, max_f64(b, c)); }

/* Sets the x of a triangle between two rows of pixels: low and high; low > high where there is no part of it. */
static void reach_between(const double *p, double top, double bottom, double *low, double *high)
{
    *low = DBL_MAX, *high = -DBL_MAX;
    for (int k = 0; k < 3; k++) {
        const double *a = p + 2 * k, *b = p + 2 * ((k + 1) % 3);
        if (a[1] >= top && a[1] <= bottom) {
            *low = min_f64(*low, a[0]);
            *high = max_f64(*high, a[0]);
        }
        for (int side = 0; side < 2; side++) {
            const double y = side ? bottom : top;
            if ((a[1] < y) == (b[1] < y))
                continue;
            const double x = a[0] + (b[0] - a[0]) * ((y - a[1]) / (b[1] - a[1]));
            const double slack = TL_SPAN_SLACK * (fabs(a[0]) + fabs(b[0]));
            *low = min_f64(*low, x - slack);
            *high = max_f64(*high, x + slack);
        }
    }
}

/* Sets the windows of row `row` that a triangle may touch. */
static void span_of_row(const tl_tiling *t, const double *p, int64_t row, int32_t *first, int32_t *end)
{
    double low, high;
    const double top = (double)(row * t->window_height_px) - TL_SPAN_MARGIN_PX;
    const double bottom = (double)((row + 1) * t->window_height_px) + TL_SPAN_MARGIN_PX;
    reach_between(p, top, bottom, &low, &high);
    *first = *end = 0;
    if (low <= high)
        windows_between(low, high, t->width_px, 1.0 / (double)t->window_width_px, first, end);
}

/* Whether three corners can be drawn: finite and within 2^62 sub-pixels. */
static inline int can_snap(const double *p, double limit)
{
    int is_good = 1;
    for (int k = 0; k < 6; k++)
        is_good &= fabs(p[k]) < limit;
    return is_good;
}

/* The windows that the box of a triangle touches. */
static inline tl_window_box box_of(const tl_tiling *t, const double *p, double per_column, double per_row)
{
    tl_window_box box;
    windows_between(min3_f64(p[0], p[2], p[4]), max3_f64(p[0], p[2], p[4]), t->width_px, per_column, &box.left,
                    &box.right);
    windows_between(min3_f64(p[1], p[3], p[5]), max3_f64(p[1], p[3], p[5]), t->height_px, per_row, &box.top,
                    &box.bottom);
    return box;
}

static int64_t list_spans(const tl_tiling *t, const double *corners_px, int64_t n, int64_t first_triangle,
                          tl_window_box *boxes, int64_t *starts, tl_window_span *out)
{
    const double limit = ldexp(1.0, 62 - t->subpixel_bits);
    const double per_column = 1.0 / (double)t->window_width_px, per_row = 1.0 / (double)t->window_height_px;
    for (int64_t i = 0; i < n; i++) {
        const double *p = corners_px + 6 * i;
        if (!out) {
            if (!can_snap(p, limit))
                return i;
            boxes[i] = box_of(t, p, per_column, per_row);
        }
        const tl_window_box box = boxes[i];
        const int is_whole = box.right - box.left == 1 || box.bottom - box.top == 1;
        for (int32_t row = box.top; row < box.bottom && box.left < box.right; row++) {
            int32_t from = box.left, to = box.right;
            if (!is_whole)
                span_of_row(t, p, row, &from, &to);
            if (from >= to)
                continue;
            if (out)
                out[starts[row]++] = (tl_window_span){(int32_t)(first_triangle + i), from, to};
            else
                starts[row + 1]++;
        }
    }
    return -1;
}

/* The list is at most TL_SHORT_SPAN times as long as the spans. */
static int64_t sort_spans(const tl_window_span *spans, int64_t n, int64_t *starts, int32_t *out)
{
    int64_t n_long = 0;
    for (int64_t i = 0; i < n; i++) {
        const tl_window_span s = spans[i];
        if (s.end - s.first > TL_SHORT_SPAN) {
            n_long++;
            continue;
        }
        for (int32_t column = s.first; column < s.end; column++) {
            if (out)
                out[starts[column]++] = s.triangle;
            else
                starts[column + 1]++;
        }
    }
    return n_long;
}

static void count_windows(const tl_window_span *spans, const int64_t *starts, int64_t n_rows, int64_t n_columns,
                          int32_t *steps)
{
    for (int64_t row = 0; row < n_rows; row++, steps += n_columns + 1) {
        for (int64_t i = starts[row]; i < starts[row + 1]; i++) {
            steps[spans[i].first]++;
            steps[spans[i].end]--;
        }
    }
}

#endif
