/* Crossings: where the edges of rings cross the sample lines of rows.
 * In: rings in fixed point.  Out: a row, a column and a direction for each row that an edge crosses.
 *
 * An edge crosses the row with its sample at Y when (y0 > Y) != (y1 > Y), and counts for the columns with a sample at
 * or right of the crossing: the top-left rule.  For an edge from its upper end (x0, y0), dy > 0, in row r and with
 * `unit` sub-pixels a pixel: column = ceil(N / D),  D = unit dy,  N = (x0 - sample_x) dy + dx (Y - y0).
 *
 * In lanes the column is floor((N + D - 1/2) / D).  Narrow coordinates are below 2^24, so N + D - 1/2 has at most 53
 * bits and is exact in float64, also after k rows (N + k unit dx).  Its quotient q by D is at least 1 / (2 D) from an
 * integer, and the product with the rounded 1 / D errs by less than 2^-51 |q|: too little, for |q| 2 D < 2 * 2^24 *
 * 2^25.  Wide rings use 128-bit integers. */
#ifndef TL_POLYGON_CROSSINGS_C
#define TL_POLYGON_CROSSINGS_C

#include <stdint.h>

#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "polygons/points.c"
#include "polygons/polygons.h"

/* Edges of at most so many rows are walked a vector of edges at a time, longer edges a vector of rows at a time: 4 and
 * 8 are slower. */
#define TL_FEW_ROWS 6

#define TL_EDGES_TO_PAUSE 4096 /* between two polls for cancelling; a multiple of TL_LANES */

/* Rows [top, bottom) of a picture of some width, and the sample of its pixels. */
typedef struct {
    int32_t top, bottom, width, center_x, center_y;
    int bits;
} row_frame;

static inline row_frame place_rows(const tl_polygons *s, int64_t top, int64_t bottom, int64_t width)
{
    const int32_t half = 1 << (s->bits - 1);
    return (row_frame){(int32_t)top,          (int32_t)bottom,       (int32_t)width,
                       half + s->sample_x_fx, half + s->sample_y_fx, s->bits};
}

/* TL_LANES edges: the column in row `row + k` is floor((num + k step) inv). */
typedef struct {
    vd num, inv, step;
    vi row, n;
    vm up;
} crossing_lanes;

TL_INLINE vm setup_crossings(const row_frame *f, vi ax, vi ay, vi bx, vi by, vm live, crossing_lanes *e)
{
    const int unit = 1 << f->bits;
    const vi before = vi_set1(unit - 1 - f->center_y);
    e->up = vi_gt(ay, by);
    const vi x0 = vi_select(e->up, bx, ax), x1 = vi_select(e->up, ax, bx), y0 = vi_min(ay, by), y1 = vi_max(ay, by);
    const vi row = vi_max(vi_shift_right(vi_add(y0, before), f->bits), vi_set1(f->top));
    const vi end = vi_min(vi_shift_right(vi_add(y1, before), f->bits), vi_set1(f->bottom));
    e->row = row;
    e->n = vi_sub(end, row);
    live = vm_and(live, vi_gt(e->n, vi_set1(0)));
    if (!vm_any(live))
        return live;
    const vd dx = vd_from_vi(vi_sub(x1, x0)), dy = vd_from_vi(vi_sub(y1, y0)), size = vd_set1((double)unit),
             d = vd_mul(dy, size);
    const vd y = vd_add(vd_mul(vd_from_vi(row), size), vd_set1((double)f->center_y));
    vd num = vd_mul(vd_from_vi(vi_sub(x0, vi_set1(f->center_x))), dy);
    num = vd_add(num, vd_mul(dx, vd_sub(y, vd_from_vi(y0))));
    e->num = vd_add(num, vd_sub(d, vd_set1(0.5)));
    e->inv = vd_div(vd_set1(1.0), d);
    e->step = vd_mul(dx, size);
    return live;
}

TL_INLINE vi crossing_columns(vd num, vd inv, vi width)
{
    return vi_min(vi_max(vi_round(vd_floor(vd_mul(num, inv))), vi_set1(0)), width);
}

/* Loads the points of TL_LANES edges from point i on of the ring [first, end); returns the lanes with an edge. */
TL_INLINE vm load_ring_edges(const tl_polygons *s, int64_t first, int64_t end, int64_t i, vi *ax, vi *ay, vi *bx,
                             vi *by)
{
    *ax = vi_load(s->x_fx + i), *ay = vi_load(s->y_fx + i);
    *bx = vi_load(s->x_fx + i + 1), *by = vi_load(s->y_fx + i + 1);
    if (i + TL_LANES < end)
        return vm_all();
    const vm inner = vm_first(end - 1 - i);
    *bx = vi_select(inner, *bx, vi_set1(s->x_fx[first])), *by = vi_select(inner, *by, vi_set1(s->y_fx[first]));
    return vm_first(end - i);
}

/* Outputs of crossings. */
typedef enum { TO_BITS, TO_COUNTS, TO_LISTS, TO_CELLS } crossing_sink_kind;
typedef struct {
    int64_t stride; /* bits or cells a row */
    uint64_t *bits; /* BITS: a bit for each crossing of a column, modulo 2 */
    int32_t *cells; /* CELLS: down less up */
    uint32_t *at;   /* COUNTS: differences of counts by row; LISTS: where the next crossing of each row goes */
    int32_t *list;  /* LISTS: 2 column + 1 when upwards */
} crossing_sink;

TL_INLINE void put_crossing(const crossing_sink *s, crossing_sink_kind kind, int64_t row, int32_t column, int up)
{
    if (kind == TO_BITS) {
        const uint64_t at = (uint64_t)(row * s->stride + column);
        s->bits[at >> 6] ^= (uint64_t)1 << (at & 63);
    } else if (kind == TO_CELLS) {
        s->cells[row * s->stride + column] += 1 - 2 * up;
    } else if (kind == TO_LISTS) {
        s->list[s->at[row]++] = 2 * column + up;
    }
}

/* Walks one edge of any size. */
static inline void walk_wide_edge(const row_frame *f, const crossing_sink *s, crossing_sink_kind kind, int64_t ax,
                                  int64_t ay, int64_t bx, int64_t by)
{
    const int up = ay > by, unit = 1 << f->bits;
    const int64_t x0 = up ? bx : ax, x1 = up ? ax : bx, y0 = up ? by : ay, y1 = up ? ay : by,
                  before = unit - 1 - f->center_y;
    int64_t row = (y0 + before) >> f->bits, end = (y1 + before) >> f->bits;
    row = row < f->top ? f->top : row, end = end > f->bottom ? f->bottom : end;
    if (row >= end)
        return;
    if (kind == TO_COUNTS) {
        s->at[row - f->top]++, s->at[end - f->top]--;
        return;
    }
    const int64_t dx = x1 - x0, dy = y1 - y0;
    const tl_int128 d = i128_product(unit, dy), step = i128_product(unit, dx), width = i128_from(f->width);
    tl_int128 num = i128_add(i128_product(x0 - f->center_x, dy), i128_product(dx, row * unit + f->center_y - y0));
    num = i128_add(num, i128_sub(d, i128_from(1)));
    for (; row < end; row++, num = i128_add(num, step)) {
        tl_int128 column, rest;
        i128_floor_divide(i128_max(num, i128_from(0)), d, &column, &rest);
        put_crossing(s, kind, row - f->top, (int32_t)i128_low(i128_min(column, width)), up);
    }
}

/* Walks edges of few rows row by row, all lanes together; walks longer edges one by one, a vector of rows at a time. */
TL_INLINE void walk_lanes(const row_frame *f, const crossing_sink *s, crossing_sink_kind kind, const crossing_lanes *e,
                          vm live)
{
    const vi width = vi_set1(f->width);
    int32_t rows[TL_LANES], counts[TL_LANES], columns[TL_LANES];
    const unsigned up = vm_bits(e->up);
    vi_spill(rows, vi_sub(e->row, vi_set1(f->top)));
    const vm is_long = vm_and(live, vi_gt(e->n, vi_set1(TL_FEW_ROWS)));
    vm left = vm_and_not(live, is_long);
    vd num = e->num;
    for (int k = 0; vm_any(left); k++) {
        vi_spill(columns, crossing_columns(num, e->inv, width));
        for (unsigned lanes = vm_bits(left); lanes; lanes &= lanes - 1) {
            const int j = __builtin_ctz(lanes);
            put_crossing(s, kind, rows[j] + k, columns[j], up >> j & 1);
        }
        num = vd_add(num, e->step);
        left = vm_and(left, vi_gt(e->n, vi_set1(k + 1)));
    }
    if (!vm_any(is_long))
        return;
    double nums[TL_LANES], invs[TL_LANES], steps[TL_LANES];
    vd_store(nums, e->num), vd_store(invs, e->inv), vd_store(steps, e->step);
    vi_spill(counts, e->n);
    const vd iota = vd_from_vi(vi_iota());
    for (unsigned lanes = vm_bits(is_long); lanes; lanes &= lanes - 1) {
        const int j = __builtin_ctz(lanes), n = counts[j], is_up = up >> j & 1;
        const vd inv = vd_set1(invs[j]), step = vd_set1(TL_LANES * steps[j]);
        vd at = vd_add(vd_mul(iota, vd_set1(steps[j])), vd_set1(nums[j]));
        for (int k = 0; k < n; k += TL_LANES) {
            vi_spill(columns, crossing_columns(at, inv, width));
            const int m = n - k < TL_LANES ? n - k : TL_LANES;
            for (int l = 0; l < m; l++)
                put_crossing(s, kind, rows[j] + k + l, columns[l], is_up);
            at = vd_add(at, step);
        }
    }
}

/* Counts the crossings of each row, as differences at the ends of edges. */
TL_INLINE void count_lanes(const row_frame *f, const crossing_sink *s, vi ay, vi by, vm live)
{
    const vi before = vi_set1((1 << f->bits) - 1 - f->center_y), top = vi_set1(f->top), bottom = vi_set1(f->bottom);
    const vi low = vi_min(vi_max(vi_shift_right(vi_add(vi_min(ay, by), before), f->bits), top), bottom);
    const vi high = vi_min(vi_max(vi_shift_right(vi_add(vi_max(ay, by), before), f->bits), top), bottom);
    int32_t lows[TL_LANES], highs[TL_LANES];
    live = vm_and(live, vi_gt(high, low));
    vi_spill(lows, vi_sub(low, top)), vi_spill(highs, vi_sub(high, top));
    for (unsigned lanes = vm_bits(live); lanes; lanes &= lanes - 1)
        s->at[lows[__builtin_ctz(lanes)]]++, s->at[highs[__builtin_ctz(lanes)]]--;
}

TL_INLINE void walk_polygon(const tl_polygons *p, int64_t polygon, const row_frame *f, const crossing_sink *s,
                            crossing_sink_kind kind)
{
    for (int64_t ring = p->polygons[polygon]; ring < p->polygons[polygon + 1]; ring++) {
        const int64_t first = p->rings[ring], end = p->rings[ring + 1];
        if (p->is_wide[polygon]) {
            for (int64_t i = first; i < end; i++) {
                const int64_t j = i + 1 < end ? i + 1 : first;
                walk_wide_edge(f, s, kind, p->wide_fx[2 * i], p->wide_fx[2 * i + 1], p->wide_fx[2 * j],
                               p->wide_fx[2 * j + 1]);
            }
            continue;
        }
        for (int64_t i = first; i < end; i += TL_LANES) {
            vi ax, ay, bx, by;
            crossing_lanes e;
            if ((i - first) % TL_EDGES_TO_PAUSE == 0 &&
                is_polygon_given_up(p, 64 * (end - i < TL_EDGES_TO_PAUSE ? end - i : TL_EDGES_TO_PAUSE)))
                return;
            vm live = load_ring_edges(p, first, end, i, &ax, &ay, &bx, &by);
            if (kind == TO_COUNTS) {
                count_lanes(f, s, ay, by, live);
                continue;
            }
            live = setup_crossings(f, ax, ay, bx, by, live, &e);
            if (vm_any(live))
                walk_lanes(f, s, kind, &e, live);
        }
    }
}

static __attribute__((noinline)) void walk_to_bits(const tl_polygons *p, int64_t polygon, const row_frame *f,
                                                   const crossing_sink *s)
{
    walk_polygon(p, polygon, f, s, TO_BITS);
}
static __attribute__((noinline)) void walk_to_cells(const tl_polygons *p, int64_t polygon, const row_frame *f,
                                                    const crossing_sink *s)
{
    walk_polygon(p, polygon, f, s, TO_CELLS);
}

#endif
