/* Blend, by area: a triangle by itself, by strips of rows with cells that stay in the first-level cache.
 * In: a triangle, or its pieces at clip planes.  Out: pixels.
 *
 * The areas are those of area.c, in cells that no other triangle shares.  They are summed from the left, and covered
 * pixels blend; between two edges whole pixels blend as a run.
 *
 * Based on: R. Levien, font-rs, 2015. */
#ifndef TL_BLEND_STRIP_C
#define TL_BLEND_STRIP_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/clip.c"
#include "vertex/fixed.h"
#include "vertex/setup.c"
#include "area/accumulate.c"
#include "area/area.c"
#include "area/ramp.c"
#include "blend/mix.c"
#include "blend/mix.h"
#include "blend/mix_f32.c"
#include "blend/mix_u8.c"

/* Blends the pixels [col, col + TL_LANES) of a row, from sample `at` on: those in m with an area > 0. */
TL_INLINE void mix_block(blend_state *b, int64_t at, vm m, vi sums, int is_u8, tl_mix mode)
{
    const vi area = vi_min(sums, vi_set1(TL_WHOLE)); /* rounding may exceed the whole by a few units */
    const vm on = vm_and(m, vi_gt(area, vi_set1(0)));
    if (!vm_any(on))
        return;
    if (!b->is_flat) {
        const unsigned bits = vm_bits(on);
        const int first = __builtin_ctz(bits), n = 32 - __builtin_clz(bits) - first;
        color_run(b, at + first, n);
        memmove(b->source + first, b->source, sizeof *b->source * (size_t)n);
        memmove(b->source_f32 + first * b->n_channels, b->source_f32,
                sizeof *b->source_f32 * (size_t)(n * b->n_channels));
    }
    if (is_u8)
        mix_block_u8(b, at, on, area, mode);
    else
        mix_block_f32(b, at, on, area, mode);
}

/* Cells of a triangle and their pixels. */
typedef struct {
    int32_t *cells; /* of column 0 */
    int64_t at;     /* the sample of column 0; columns outside [first, end) are not drawn */
    int32_t stride, n_rows, first, end;
    int has_left; /* the four cells before column 0 count */
} cell_block;

/* Returns the sum of the four cells left of column 0, and clears them. */
TL_INLINE int32_t take_left_cells(int32_t *cells)
{
    int32_t sum = 0;
    for (int k = -4; k < 0; k++) {
        sum += cells[k] - TL_CELL_ZERO;
        cells[k] = TL_CELL_ZERO;
    }
    return sum;
}

/* Sums the cells of each row from the left, blends, and clears the cells.  Whole pixels between two edges blend as a
 * run. */
TL_INLINE void blend_cells(blend_state *b, const cell_block *c, int is_u8, tl_mix mode)
{
    const vi bias = vi_set1(TL_CELL_ZERO);
    for (int32_t row = 0; row < c->n_rows; row++) {
        int32_t *cells = c->cells + (int64_t)row * c->stride, whole_from = -1, sum = 0, last[TL_MAX_LANES];
        const int64_t at = c->at + row * b->stride;
        if (c->has_left)
            sum = take_left_cells(cells);
        for (int32_t col = 0; col < c->end; col += TL_LANES) {
            const vi values = vi_sub(vi_load(cells + col), bias);
            const int is_constant = !vm_any(vm_and_not(vm_all(), vi_eq(values, vi_set1(0))));
            if (is_constant && sum <= 0 && whole_from < 0)
                continue;
            if (is_constant && sum >= TL_WHOLE) {
                whole_from = whole_from >= 0 ? whole_from : col > c->first ? col : c->first;
                continue;
            }
            if (whole_from >= 0 && whole_from < col)
                mix_pixels(b, at + whole_from, col - whole_from);
            whole_from = -1;
            const vi sums = vi_add(vi_prefix_sum(values), vi_set1(sum));
            vi_store(cells + col, bias);
            vi_store(last, sums);
            sum = last[TL_LANES - 1];
            mix_block(b, at + col, vm_and_not(vm_first(c->end - col), vm_first(c->first - col)), sums, is_u8, mode);
        }
        if (whole_from >= 0 && whole_from < c->end)
            mix_pixels(b, at + whole_from, c->end - whole_from);
    }
}

/* Prefetches the pixels of n_rows x n_cols samples: the work on a row is too long for the loads of the next row to
 * start early. */
TL_INLINE void fetch_pixels(const blend_state *b, int64_t at, int64_t n_rows, int64_t n_cols)
{
    const int64_t pixel_bytes = b->canvas->is_u8 ? 4 : 4 * b->n_channels;
    const char *pixels = b->canvas->is_u8 ? (const char *)b->packed : (const char *)b->floats;
    for (int64_t row = 0; row < n_rows; row++) {
        const char *p = pixels + (at + row * b->stride) * pixel_bytes;
        for (int64_t k = 0; k <= n_cols * pixel_bytes; k += 64)
            __builtin_prefetch(p + k, 1);
    }
}

static __attribute__((noinline)) void blend_cells_u8(blend_state *b, const cell_block *c)
{
    TL_MIX_CALL(blend_cells, b->mode, b, c, 1)
}

/* one copy for all modes: memory bandwidth is the limit */
static __attribute__((noinline)) void blend_cells_f32(blend_state *b, const cell_block *c)
{
    blend_cells(b, c, 0, b->mode);
}

static void blend_block(blend_state *b, const cell_block *c)
{
    if (b->canvas->is_u8)
        blend_cells_u8(b, c);
    else
        blend_cells_f32(b, c);
}

/* Adds an edge to the cells of a strip.  The bits equal those of a queue of area.c. */
static void add_edge(area_plane *plane, int64_t x0, int64_t y0, int64_t x1, int64_t y1)
{
    edge_record record;
    const int kind = take_edge(plane, max_edge_extent(plane->bits), x0, y0, x1, y1, &record);
    if (kind < 0 || kind == TL_EDGES_NONE)
        return;
    if (kind == TL_EDGES_SHALLOW)
        add_shallow_edges(plane, &record, 1);
    else if (kind >= TL_EDGES_FLAT)
        add_flat_edges(plane, &record, 1);
    else
        add_steep_edges(plane, &record, 1);
}

/* fmin and fmax are calls unless NaN is ruled out. */
static inline double lesser(double a, double b) { return a < b ? a : b; }
static inline double greater(double a, double b) { return a > b ? a : b; }

/* Sets the columns of the picture that a triangle may touch between two heights. */
static void strip_columns(const tl_triangle *t, double top_fx, double bottom_fx, int bits, double *left, double *right)
{
    const double unit = (double)((int64_t)1 << bits);
    double low = INFINITY, high = -INFINITY;
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        const double x0 = (double)t->x_fx[k], x1 = (double)t->x_fx[next], y0 = (double)t->y_fx[k];
        const double y1 = (double)t->y_fx[next];
        const double first = greater(lesser(y0, y1), top_fx), end = lesser(greater(y0, y1), bottom_fx);
        if (first > end)
            continue;
        const double slope = y1 == y0 ? 0.0 : (x1 - x0) / (y1 - y0);
        const double a = y1 == y0 ? x0 : x0 + (first - y0) * slope, b = y1 == y0 ? x1 : x0 + (end - y0) * slope;
        low = lesser(low, lesser(a, b)), high = greater(high, greater(a, b));
    }
    /* narrow: the error is below 2^-20 sub-pixels; otherwise all columns are taken */
    *left = t->is_narrow ? floor(low / unit) - 1.0 : -INFINITY;
    *right = t->is_narrow ? floor(high / unit) + 2.0 : INFINITY;
}

/* The rows of a strip n_cols wide: its cells take half of the first-level cache; at least TL_STRIP_ROWS. */
static int strip_rows(int64_t n_cols)
{
    const int64_t rows = 4096 / tl_area_stride(n_cols) / TL_STRIP_ROWS * TL_STRIP_ROWS;
    return (int)max64(rows, TL_STRIP_ROWS);
}

/* Blends the parts of n triangles, the pieces of one, in rows [row, row + n_rows) of the window. */
static void blend_strip(blend_state *b, const tl_triangle *pieces, int64_t n, int64_t row, int n_rows)
{
    const tl_window *window = b->window;
    const int bits = window->subpixel_bits;
    const double unit = (double)((int64_t)1 << bits);
    double left = INFINITY, right = -INFINITY;
    for (int64_t i = 0; i < n; i++) {
        double from, to;
        strip_columns(pieces + i, (double)(window->y_px + row) * unit, (double)(window->y_px + row + n_rows) * unit,
                      bits, &from, &to);
        left = lesser(left, from), right = greater(right, to);
    }
    lay_ground(b, row + n_rows);
    left = greater(left - (double)window->x_px, 0.0),
    right = lesser(right - (double)window->x_px, (double)window->width);
    if (!(left < right))
        return;
    const int64_t col = (int64_t)left;
    const tl_window strip = {
        window->x_px + col, window->y_px + row, (int64_t)right - col, n_rows, bits, TL_TEST_SAMPLE, NULL};
    area_plane plane;
    fetch_pixels(b, row * b->stride + col, n_rows, min64(strip.width, 128));
    place_plane(&strip, &(tl_area){.cells = b->canvas->cells}, &plane);
    for (int64_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) {
            const int next = k == 2 ? 0 : k + 1;
            add_edge(&plane, pieces[i].x_fx[k], pieces[i].y_fx[k], pieces[i].x_fx[next], pieces[i].y_fx[next]);
        }
    flush_quads(&plane);
    blend_block(b, &(cell_block){
                       .cells = plane.cells + TL_CELL_PAD,
                       .at = row * b->stride + col,
                       .stride = plane.stride,
                       .n_rows = n_rows,
                       .end = plane.n_cols,
                       .has_left = 1,
                   });
    for (int64_t k = 0; k < n_rows; k++) /* clears cells right of the window */
        for (int64_t i = plane.n_cols / TL_LANES * TL_LANES; i < plane.stride - TL_CELL_PAD; i += TL_LANES)
            vi_store(plane.cells + k * plane.stride + TL_CELL_PAD + i, vi_set1(TL_CELL_ZERO));
}

#endif
