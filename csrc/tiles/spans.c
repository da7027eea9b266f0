/* Spans: which windows of a raster each triangle may touch, a span of windows for each row of them.
 * In: corners in pixels, before the snap.  Out: spans sorted by rows of windows, by index within a row.
 *
 * A span may have windows too many, never too few: the box of a triangle is widened by TL_SPAN_MARGIN_PX, which is more
 * than what the snap moves (half a pixel at most) and what a pixel's square adds.  A triangle of more than one row and
 * column of windows is cut by each row, so that a long thin one is listed along its way and not in all of its box.  The
 * point where an edge enters a row is computed in float64: its error is below 2^-50 of the largest coordinate, and
 * TL_SPAN_SLACK of it is added. */
#ifndef TL_SPANS_C
#define TL_SPANS_C

#include <float.h>
#include <math.h>
#include <stdint.h>

#include "topleft.h"

#define TL_SPAN_MARGIN_PX 2.0
#define TL_SPAN_SLACK 0x1p-44

/* Windows [*first, *end) of `n` with `side` pixels each that the pixels from low to high touch. */
static inline void windows_between(double low, double high, int64_t length_px, int64_t side, int64_t *first,
                                   int64_t *end)
{
    const double from = low - TL_SPAN_MARGIN_PX, to = high + TL_SPAN_MARGIN_PX;
    *first = *end = 0;
    if (to < 0.0 || from >= (double)length_px)
        return;
    *first = from <= 0.0 ? 0 : (int64_t)from / side;
    *end = (to >= (double)(length_px - 1) ? length_px - 1 : (int64_t)to) / side + 1;
}

static inline double min3_f64(double a, double b, double c) { return fmin(a, fmin(b, c)); }
static inline double max3_f64(double a, double b, double c) { return fmax(a, fmax(b, c)); }

/* The x of a triangle between two rows of pixels: low and high, which are crossed where there is nothing. */
static void reach_between(const double *p, double top, double bottom, double *low, double *high)
{
    *low = DBL_MAX, *high = -DBL_MAX;
    for (int k = 0; k < 3; k++) {
        const double *a = p + 2 * k, *b = p + 2 * ((k + 1) % 3);
        if (a[1] >= top && a[1] <= bottom) {
            *low = fmin(*low, a[0]);
            *high = fmax(*high, a[0]);
        }
        for (int side = 0; side < 2; side++) {
            const double y = side ? bottom : top;
            if ((a[1] < y) == (b[1] < y))
                continue;
            const double x = a[0] + (b[0] - a[0]) * ((y - a[1]) / (b[1] - a[1]));
            const double slack = TL_SPAN_SLACK * (fabs(a[0]) + fabs(b[0]));
            *low = fmin(*low, x - slack);
            *high = fmax(*high, x + slack);
        }
    }
}

/* The windows of row `row` that a triangle may touch. */
static void span_of_row(const tl_tiling *t, const double *p, int64_t row, int64_t *first, int64_t *end)
{
    double low, high;
    const double top = (double)(row * t->window_height_px) - TL_SPAN_MARGIN_PX;
    const double bottom = (double)((row + 1) * t->window_height_px) + TL_SPAN_MARGIN_PX;
    reach_between(p, top, bottom, &low, &high);
    *first = *end = 0;
    if (low <= high)
        windows_between(low, high, t->width_px, t->window_width_px, first, end);
}

/* Whether three corners can be drawn: finite and within 2^62 sub-pixels. */
static inline int can_snap(const tl_tiling *t, const double *p)
{
    const double limit = ldexp(1.0, 62 - t->subpixel_bits);
    for (int k = 0; k < 6; k++)
        if (!(fabs(p[k]) < limit))
            return 0;
    return 1;
}

/* Counts the spans of each row into starts[row + 1], or with `out` writes them from starts[row] on, which moves. */
static int64_t list_spans(const tl_tiling *t, const double *corners_px, int64_t n, int64_t first_triangle,
                          int64_t *starts, tl_window_span *out)
{
    for (int64_t i = 0; i < n; i++) {
        const double *p = corners_px + 6 * i;
        if (!out && !can_snap(t, p))
            return i;
        int64_t first, end, top, bottom;
        windows_between(min3_f64(p[0], p[2], p[4]), max3_f64(p[0], p[2], p[4]), t->width_px, t->window_width_px, &first,
                        &end);
        windows_between(min3_f64(p[1], p[3], p[5]), max3_f64(p[1], p[3], p[5]), t->height_px, t->window_height_px, &top,
                        &bottom);
        const int is_box = end - first == 1 || bottom - top == 1;
        for (int64_t row = top; row < bottom && first < end; row++) {
            int64_t from = first, to = end;
            if (!is_box)
                span_of_row(t, p, row, &from, &to);
            if (from >= to)
                continue;
            if (out)
                out[starts[row]++] = (tl_window_span){(int32_t)(first_triangle + i), (int32_t)from, (int32_t)to};
            else
                starts[row + 1]++;
        }
    }
    return -1;
}

#endif
