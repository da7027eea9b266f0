/* Ramp: adds one pixel row of an edge to the area of the pixels, as differences from each pixel to the next.
 * In: edges, top to bottom.  Out: cells; their sums from the left are the area right of the edges.
 *
 * In its row an edge runs from `low` to `high` and is `height` tall.  In pixel [k, k + 1) the area right of it is Q(k +
 * 1) - Q(k), where Q(x) = steep * (min(x, high) - low)^2 + height * max(x - high, 0), steep = height / (2 (high -
 * low)).  It is computed in float64 and rounded once, to 2^-24 px^2.  Only its sign depends on the triangle, and
 * nothing on the window: shared edges of two triangles cancel exactly.
 *
 * Error: x is off by less than 2^-36 px (three roundings of numbers below 2^14 + 1), Q by less than 2^-11 of a unit, so
 * an area is off by less than 0.501 units of 2^-24 px^2, and is exact right of `high`: a height is a whole number of
 * units.
 *
 * An edge of any length and position, |x_fx| < 2^62, has equal differences (`add_exact_edge`): where it enters and
 * leaves a row is then an exact quotient of 128-bit integers; only its fraction is rounded to float64, and the length
 * of the ramp.  Such an area errs by less than 2^-23 of a unit before it is rounded.
 *
 * Based on: R. Levien, font-rs (signed area, accumulated along rows), 2015; D. Turner, FreeType's smooth rasterizer
 * (cells of area and cover), 2001. */
#ifndef TL_RAMP_C
#define TL_RAMP_C

#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"

#define TL_AREA_BITS 24
/* cells before column 0: rows start on a cache line, and the last four cells get areas left of it */
#define TL_CELL_PAD 16
/* The bias of a cell.  No addition changes a cell by more than 2^24 + 1, so a value that leaves [-2^30, 2^30) sets the
 * sign bit before it can wrap, and `seen` keeps that bit. */
#define TL_CELL_ZERO TL_CELL_CLEAR

#define TL_WAITING_QUADS 256 /* 64 and 512 are slower */

/* The cells of a window. */
typedef struct {
    int32_t *cells;      /* (n_rows, stride), TL_CELL_ZERO if empty; or NULL */
    int64_t *wide_cells; /* as `cells` in 64 bits, which cannot overflow, 0 if empty */
    int32_t stride, n_cols, n_rows;
    int64_t x_px, y_px;                           /* picture pixel of the first cell */
    int32_t left_px, top_px;                      /* x_px, y_px, clamped for lanes */
    int32_t top_fx, bottom_fx, left_fx, right_fx; /* the window's border, clamped for lanes */
    int bits;
    int is_sparse; /* most cells are met by no edge; for `accumulate` */
    int n_waiting; /* quads to be added to cells [at, at + 4), in the order of vi_store_quads */
    int32_t at[TL_WAITING_QUADS], quads[4 * TL_WAITING_QUADS];
    v4 seen; /* bitwise or of all values that cells have had */
} area_plane;

/* An edge that fits 32-bit lanes, upper end first. */
typedef struct {
    int32_t x_fx, y_fx, dx;
    int32_t signed_dy; /* > 0: the area right of it is added, < 0: subtracted */
} edge_record;

/* The setup of an edge; edge_lanes: of TL_LANES edges. */
typedef struct {
    double x, slope;           /* px from the pixel column of the upper end; px per unit of y_fx */
    double steep, height;      /* cell units per px of x, halved; cell units per unit of y_fx */
    int32_t col, row;          /* of the upper end, in the plane */
    int32_t t, t_first, t_end; /* y_fx from the upper end: of the top of `row`, of the part in the plane */
} edge_one;

typedef struct {
    vd x, slope, steep, height;
    vi col, row, t, t_first, t_end;
} edge_lanes;

static inline int32_t clamp32(int64_t a, int64_t low, int64_t high)
{
    return (int32_t)(a < low ? low : a > high ? high : a);
}
TL_INLINE vi vi_clamp(vi a, vi low, vi high) { return vi_min(vi_max(a, low), high); }

TL_INLINE edge_lanes setup_edge_lanes(const area_plane *plane, const int32_t *records)
{
    vi r[4];
    edge_lanes e;
    const int bits = plane->bits;
    const double pixel = 1.0 / (double)(1 << bits), height = (double)(1 << TL_AREA_BITS) * pixel;
    vi_load_quads(records, r);
    const vi zero = vi_set1(0), dy = vi_max(r[3], vi_sub(zero, r[3]));
    const vm is_added = vi_gt(r[3], zero);
    const vd dx_fx = vd_from_vi(r[2]), dy_fx = vd_from_vi(dy);
    const vd half = vd_select(is_added, vd_set1(0.5 * (1 << TL_AREA_BITS)), vd_set1(-0.5 * (1 << TL_AREA_BITS)));
    e.x = vd_mul(vd_from_vi(vi_and(r[0], vi_set1((1 << bits) - 1))), vd_set1(pixel));
    e.slope = vd_mul(vd_div(dx_fx, dy_fx), vd_set1(pixel));
    e.steep = vd_select(vi_eq(r[2], zero), vd_set1(0.0), vd_div(vd_mul(dy_fx, half), vd_abs(dx_fx)));
    e.height = vd_select(is_added, vd_set1(height), vd_set1(-height));
    e.col = vi_sub(vi_shift_right(r[0], bits), vi_set1(plane->left_px));
    e.row = vi_sub(vi_shift_right(r[1], bits), vi_set1(plane->top_px));
    e.t = vi_sub(zero, vi_and(r[1], vi_set1((1 << bits) - 1)));
    e.t_first = vi_max(zero, vi_sub(vi_set1(plane->top_fx), r[1]));
    e.t_end = vi_min(dy, vi_sub(vi_set1(plane->bottom_fx), r[1]));
    return e;
}

/* `setup_edge_lanes` for a single edge: equal bits. */
static inline edge_one setup_edge(const area_plane *plane, const edge_record *r)
{
    const int32_t mask = (1 << plane->bits) - 1, dy = r->signed_dy < 0 ? -r->signed_dy : r->signed_dy;
    const double pixel = 1.0 / (double)(1 << plane->bits), sign = r->signed_dy < 0 ? -1.0 : 1.0;
    return (edge_one){
        .x = (double)(r->x_fx & mask) * pixel,
        .slope = (double)r->dx / (double)dy * pixel,
        .steep = r->dx == 0 ? 0.0 : (double)dy * (sign * 0.5 * (1 << TL_AREA_BITS)) / fabs((double)r->dx),
        .height = sign * (1 << TL_AREA_BITS) * pixel,
        .col = (r->x_fx >> plane->bits) - plane->left_px,
        .row = (r->y_fx >> plane->bits) - plane->top_px,
        .t = -(r->y_fx & mask),
        .t_first = clamp32((int64_t)plane->top_fx - r->y_fx, 0, INT32_MAX),
        .t_end = clamp32((int64_t)plane->bottom_fx - r->y_fx, INT32_MIN, dy),
    };
}

/* Adds buffered quads to the cells.  The cells are scattered beyond the second-level cache: to compute first, prefetch
 * meanwhile and add later saves a third for 200,000 triangles of 8 px. */
TL_ONCE void flush_quads(area_plane *plane)
{
    const int n = plane->n_waiting;
    v4 seen = plane->seen;
    plane->n_waiting = 0;
    for (int i = 0; plane->wide_cells && i < n; i++)
        for (int k = 0; k < 4; k++)
            plane->wide_cells[plane->at[i] + k] +=
                plane->quads[4 * (i - i % TL_LANES + vi_quad_slot(i % TL_LANES)) + k];
    for (int i = 0; plane->cells && i < n; i += TL_LANES) {
        const int32_t *const at = plane->at + i, *const quads = plane->quads + 4 * i;
        for (int lane = 0; lane < TL_LANES; lane++) {
            int32_t *p = plane->cells + at[lane];
            const v4 sum = v4_add(v4_load(p), v4_load(quads + 4 * vi_quad_slot(lane)));
            v4_store(p, sum);
            seen = v4_or(seen, sum);
        }
    }
    plane->seen = seen;
}

/* Buffers four numbers a lane, to be added to the cells [at, at + 4) of that lane. */
TL_INLINE void add_quads(area_plane *plane, vi at, const vi *columns)
{
    const int n = plane->n_waiting;
    int32_t *const places = plane->at + n; /* with at[n + lane] gcc adds and widens for each lane */
    vi_store(places, at);
    vi_store_quads(plane->quads + 4 * n, columns);
    for (int lane = 0; plane->cells && lane < TL_LANES; lane++)
        __builtin_prefetch(plane->cells + places[lane], 1);
    plane->n_waiting = n + TL_LANES;
    if (n + TL_LANES == TL_WAITING_QUADS)
        flush_quads(plane);
}

/* The areas of a row of TL_LANES edges that run from xa to xb, less than 4 * n_quads - 2 px apart: right of them, in 4
 * * n_quads pixels; returns their first column.  The ramp ends left of the last of these pixels. */
TL_INLINE vi ramp_areas(int n_quads, vd xa, vd xb, vd steep, vd height, vi *areas)
{
    const vd low = vd_min(xa, xb), high = vd_max(xa, xb), first = vd_floor(low), zero = vd_set1(0.0);
    const vd lo = vd_sub(low, first), hi = vd_sub(high, first);
    const int n = 4 * n_quads;
    vd before = zero;
    for (int k = 1; k < n; k++) {
        vd q;
        if (k < n - 1) {
            const vd x = vd_set1(k), width = vd_sub(vd_min(hi, x), lo);
            q = vd_add(vd_mul(vd_mul(width, width), steep), vd_mul(vd_max(vd_sub(x, hi), zero), height));
        } else { /* all of the ramp is left of here */
            q = vd_mul(height, vd_sub(vd_set1(k), vd_mul(vd_set1(0.5), vd_add(lo, hi))));
        }
        areas[k - 1] = vi_round(vd_sub(q, before));
        before = q;
    }
    areas[n - 1] = vi_round(height);
    return vi_round(first);
}

/* Buffers the areas of `ramp_areas` for the cells of a plane, as differences from cell to cell. */
TL_INLINE void add_row(area_plane *plane, int n_quads, vd xa, vd xb, vd steep, vd height, vi col, vi row)
{
    const int n = 4 * n_quads;
    vi areas[8], cells[8];
    const vi first = ramp_areas(n_quads, xa, xb, steep, height, areas);
    for (int k = 0; k < n; k++)
        cells[k] = k ? vi_sub(areas[k], areas[k - 1]) : areas[k];
    const vi start = vi_add(vi_mul(row, vi_set1(plane->stride)), vi_set1(TL_CELL_PAD));
    const vi c = vi_add(col, first);
    /* cells outside: all to the left go to the four cells before column 0, all to the right to unread cells */
    for (int k = 0; k < n; k += 4) {
        const vi at = vi_clamp(vi_add(c, vi_set1(k)), vi_set1(-4), vi_set1(plane->n_cols));
        add_quads(plane, vi_add(start, at), cells + k);
    }
}

/* Draws TL_LANES edges at a time, all of n_rows rows. */
TL_INLINE void add_short_edges(area_plane *plane, int n_quads, const edge_record *records, int n, int n_rows)
{
    const vi last_row = vi_set1(plane->n_rows - 1), zero = vi_set1(0);
    for (int i = 0; i < n; i += TL_LANES) {
        const edge_lanes e = setup_edge_lanes(plane, &records[i].x_fx);
        vi ta = vi_clamp(e.t, e.t_first, e.t_end);
        vd xa = vd_add(e.x, vd_mul(vd_from_vi(ta), e.slope));
        for (int j = 0; j < n_rows; j++) {
            const vi tb = vi_clamp(vi_add(e.t, vi_set1((j + 1) << plane->bits)), e.t_first, e.t_end);
            const vd xb = vd_add(e.x, vd_mul(vd_from_vi(tb), e.slope));
            const vd height = vd_mul(vd_from_vi(vi_sub(tb, ta)), e.height);
            const vi row = vi_clamp(vi_add(e.row, vi_set1(j)), zero, last_row); /* rows outside have no height */
            add_row(plane, n_quads, xa, xb, e.steep, height, e.col, row);
            ta = tb;
            xa = xb;
        }
    }
}

/* Draws edges of many rows, TL_LANES rows of one edge at a time. */
TL_INLINE void add_long_edges(area_plane *plane, int n_quads, const edge_record *records, int n)
{
    const vi last_row = vi_set1(plane->n_rows - 1), zero = vi_set1(0), rows = vi_iota();
    for (int i = 0; i < n; i++) {
        const edge_one e = setup_edge(plane, records + i);
        const int bits = plane->bits, j0 = e.row < 0 ? -e.row : 0;
        const vi first = vi_set1(e.t_first), end = vi_set1(e.t_end);
        for (int j = j0; ((int64_t)j << bits) + e.t < e.t_end; j += TL_LANES) {
            const vi t = vi_add(vi_set1(e.t + (j << bits)), vi_shift_left(rows, bits));
            const vi ta = vi_clamp(t, first, end), tb = vi_clamp(vi_add(t, vi_set1(1 << bits)), first, end);
            const vd xa = vd_add(vd_set1(e.x), vd_mul(vd_from_vi(ta), vd_set1(e.slope)));
            const vd xb = vd_add(vd_set1(e.x), vd_mul(vd_from_vi(tb), vd_set1(e.slope)));
            const vd height = vd_mul(vd_from_vi(vi_sub(tb, ta)), vd_set1(e.height));
            const vi row = vi_clamp(vi_add(vi_set1(e.row + j), rows), zero, last_row);
            add_row(plane, n_quads, xa, xb, vd_set1(e.steep), height, vi_set1(e.col), row);
        }
    }
}

/* Draws one row of one edge that crosses many pixels, from low to high px right of column col; TL_LANES pixels at a
 * time. */
TL_INLINE void add_wide_row(area_plane *plane, int64_t row, int64_t col, double low, double high, double steep,
                            double height)
{
    if (col >= plane->n_cols)
        return;
    /* the cell before column 0 gets the area left of it: `left_sum` would take negative parts for an overflow */
    const int64_t first = col < 0 ? -col - 1 : 0, passed = (int64_t)high + 2;
    const int64_t visible = passed < plane->n_cols - col ? passed : plane->n_cols - col;
    const int64_t end = visible > first ? visible : first + 1;
    const vd zero = vd_set1(0.0), one = vd_set1(1.0), lo = vd_set1(low), hi = vd_set1(high);
    const int64_t at = row * plane->stride + TL_CELL_PAD + col;
    vi before = vi_set1(0);
    vi seen = before;
    for (int64_t k = first; k < end; k += TL_LANES) {
        const vd x = vd_add(vd_set1((double)k), vd_from_vi(vi_iota())), next = vd_add(x, one);
        const vd a = vd_min(vd_max(x, lo), hi), b = vd_min(vd_max(next, lo), hi);
        const vd mean = vd_mul(vd_sub(vd_add(a, b), vd_add(lo, lo)), vd_set1(steep));
        const vd right = vd_mul(vd_min(vd_max(vd_sub(next, hi), zero), one), vd_set1(height));
        const vi area = vi_round(vd_add(vd_mul(mean, vd_sub(b, a)), right));
        const vi cells = vi_sub(area, vi_shift_in(area, before));
        before = area;
        if (plane->wide_cells) {
            int32_t values[TL_LANES];
            vi_store(values, cells);
            for (int i = 0; i < TL_LANES; i++)
                plane->wide_cells[at + k + i] += values[i];
        } else {
            const vi sum = vi_add(vi_load(plane->cells + at + k), cells);
            vi_store(plane->cells + at + k, sum);
            seen = vi_or(seen, sum);
        }
    }
    if (vm_any(vi_gt(vi_set1(0), seen)))
        plane->seen = v4_or(plane->seen, v4_load((const int32_t[4]){INT32_MIN, 0, 0, 0}));
}

/* Draw edges of many rows that cross up to 2 columns a row, or up to 6. */
TL_ONCE void add_steep_edges(area_plane *plane, const edge_record *records, int n)
{
    add_long_edges(plane, 1, records, n);
}
TL_ONCE void add_flat_edges(area_plane *plane, const edge_record *records, int n)
{
    add_long_edges(plane, 2, records, n);
}

/* Draws edges that cross any number of columns a row. */
TL_ONCE void add_shallow_edges(area_plane *plane, const edge_record *records, int n)
{
    for (int i = 0; i < n; i++) {
        const edge_one e = setup_edge(plane, records + i);
        const int bits = plane->bits;
        for (int j = e.row < 0 ? -e.row : 0; ((int64_t)j << bits) + e.t < e.t_end; j++) {
            const int32_t t = e.t + (j << bits), ta = clamp32(t, e.t_first, e.t_end);
            const int32_t tb = clamp32((int64_t)t + (1 << bits), e.t_first, e.t_end);
            const double xa = e.x + (double)ta * e.slope, xb = e.x + (double)tb * e.slope;
            const double low = xa < xb ? xa : xb, high = xa < xb ? xb : xa, first = floor(low);
            add_wide_row(plane, e.row + j, e.col + (int64_t)first, low - first, high - first, e.steep,
                         (tb - ta) * e.height);
        }
    }
}

/* The area right of a ramp from low to high in pixel k, in cell units: Q(k + 1) - Q(k). */
static inline int32_t exact_area(int64_t k, double low, double high, double steep, double height)
{
    if (k >= (int64_t)1 << 50) { /* k + 1 may not exist; the ramp is so long that its ends have no effect */
        const double mean = 2.0 * (double)k * steep;
        return (int32_t)rint(fabs(mean) < fabs(height) ? mean : height);
    }
    const double x = (double)k, next = x + 1.0;
    const double a = fmin(fmax(x, low), high), b = fmin(fmax(next, low), high);
    const double right = fmin(fmax(next - high, 0.0), 1.0);
    return (int32_t)rint((a + b - (low + low)) * steep * (b - a) + right * height);
}

/* Draws one row of an edge, from low to high px right of column col. */
static void add_exact_row(area_plane *plane, int64_t row, int64_t col, double low, double high, double steep,
                          double height)
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

/* Draws an edge from its upper to its lower end; sign > 0: adds the area right of it. */
static void add_exact_edge(area_plane *plane, int64_t x0, int64_t y0, int64_t x1, int64_t y1, int sign)
{
    const int bits = plane->bits;
    const int64_t unit = (int64_t)1 << bits;
    const int64_t dx = x1 - x0, dy = y1 - y0;
    const tl_int128 divisor = i128_product(dy, unit);
    const int64_t first = max64(y0 >> bits, plane->y_px);
    const int64_t end = min64(((y1 - 1) >> bits) + 1, plane->y_px + plane->n_rows);
    if (dy == 0)
        return;
    const double height = sign * (double)(1 << TL_AREA_BITS) / (double)unit;
    const double steep = dx == 0 ? 0.0 : sign * 0.5 * (1 << TL_AREA_BITS) * (double)dy / fabs((double)dx);
    for (int64_t row = first; row < end; row++) {
        const int64_t t = row * unit - y0, ta = max64(t, 0), tb = t < dy - unit ? t + unit : dy;
        const tl_int128 xa = i128_add(i128_product(x0 & (unit - 1), dy), i128_product(ta, dx)); /* below 2^126 + 2^79 */
        const tl_int128 step = i128_product(tb - ta, dx);
        tl_int128 quotient, rest;
        i128_floor_divide(dx < 0 ? i128_add(xa, step) : xa, divisor, &quotient, &rest);
        const int64_t whole = (x0 >> bits) + i128_low(quotient);
        const double unit_rows = i128_to_f64(divisor), low = i128_to_f64(rest) / unit_rows;
        const double high = low + fabs(i128_to_f64(step)) / unit_rows;
        add_exact_row(plane, row - plane->y_px, whole - plane->x_px, low, high, steep, (double)(tb - ta) * height);
    }
}

#endif
