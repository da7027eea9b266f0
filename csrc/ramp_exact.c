/* Ramp, exactly: the same differences for an edge of any length and anywhere.
 * In: an edge with |x_fx| < 2^62.  Out: cells, as in ramp.c.
 *
 * Where an edge enters and leaves a row is an exact quotient of 128-bit integers; what is rounded to float64 is only its
 * fraction and the length of the ramp. */
#include "fixed.h"
#include "lanes.h"

/* The area right of a ramp from low to high in pixel k, in cell units: ramp.c's Q(k + 1) - Q(k). */
static inline int32_t exact_area(int64_t k, double low, double high, double steep, double height)
{
    if (k >= (int64_t)1 << 50) { /* k + 1 may not exist; here the ramp is so long that its ends do not show */
        const double mean = 2.0 * (double)k * steep;
        return (int32_t)rint(fabs(mean) < fabs(height) ? mean : height);
    }
    const double x = (double)k, next = x + 1.0;
    const double a = fmin(fmax(x, low), high), b = fmin(fmax(next, low), high);
    const double right = fmin(fmax(next - high, 0.0), 1.0);
    return (int32_t)rint((a + b - (low + low)) * steep * (b - a) + right * height);
}

/* One row, from low to high px right of column col. */
static void add_exact_row(area_plane *plane, int64_t row, int64_t col, double low, double high, double steep, double height)
{
    if (col >= plane->n_cols)
        return;
    const int64_t first = col < 0 ? -col : 0, passed = high < 0x1p61 ? (int64_t)high + 2 : (int64_t)1 << 61;
    const int64_t visible = min64(passed, plane->n_cols - col), end = max64(visible, first + 1);
    const int64_t at = row * plane->stride + TL_CELL_PAD + col;
    int32_t before = 0, seen = 0;
    for (int64_t k = first; k < end; k++) {
        const int32_t area = exact_area(k, low, high, steep, height);
        if (plane->wide_cells) {
            plane->wide_cells[at + k] += area - before;
        } else {
            plane->cells[at + k] = (int32_t)((uint32_t)plane->cells[at + k] + (uint32_t)(area - before));
            seen |= plane->cells[at + k];
        }
        before = area;
    }
    plane->seen = v4_or(plane->seen, v4_load((const int32_t[4]){seen, 0, 0, 0}));
}

/* An edge from its upper to its lower end; sign > 0: what lies right of it is added. */
static void add_exact_edge(area_plane *plane, int64_t x0, int64_t y0, int64_t x1, int64_t y1, int sign)
{
    const int bits = plane->bits;
    const int64_t unit = (int64_t)1 << bits;
    const tl_int128 dx = (tl_int128)x1 - x0, dy = (tl_int128)y1 - y0, divisor = dy * unit;
    const int64_t first = max64(y0 >> bits, plane->y_px), end = min64(((y1 - 1) >> bits) + 1, plane->y_px + plane->n_rows);
    if (dy == 0)
        return;
    const double height = sign * (double)(1 << TL_AREA_BITS) / (double)unit;
    const double steep = dx == 0 ? 0.0 : sign * 0.5 * (1 << TL_AREA_BITS) * (double)dy / fabs((double)dx);
    for (int64_t row = first; row < end; row++) {
        const tl_int128 t = (tl_int128)row * unit - y0, ta = t > 0 ? t : 0, tb = t + unit < dy ? t + unit : dy;
        const tl_int128 xa = (x0 & (unit - 1)) * dy + ta * dx, step = (tb - ta) * dx; /* below 2^126 */
        tl_int128 quotient, rest;
        floor_divide_128(step < 0 ? xa + step : xa, divisor, &quotient, &rest);
        const int64_t whole = (x0 >> bits) + (int64_t)quotient;
        const double low = (double)rest / (double)divisor, high = low + fabs((double)step) / (double)divisor;
        add_exact_row(plane, row - plane->y_px, whole - plane->x_px, low, high, steep, (double)(int64_t)(tb - ta) * height);
    }
}
