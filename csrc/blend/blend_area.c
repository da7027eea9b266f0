/* Blend, by area: the pass that weights each triangle by its area in each pixel's square.
 * In: triangles, one after the other.  Out: pixels.
 *
 * Small triangles are stacked in an atlas of cells, shifted by whole pixels, which changes no bit: so edges of many
 * triangles fill the lanes of ramp.c.  Then the cells are summed and the colours blended, triangle by triangle.  A
 * triangle that is too large for the atlas flushes it and is drawn by itself. */
#ifndef TL_BLEND_AREA_C
#define TL_BLEND_AREA_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "vertex/snap.c"
#include "raster/triangles_fixed.c"
#include "area/area.c"
#include "area/ramp.c"
#include "blend/blend_rows.c"
#include "blend/blend_strip.c"
#include "blend/mix.c"
#include "blend/mix.h"

#define TL_ATLAS_COLS 16
#define TL_ATLAS_TRIANGLES 256

typedef struct {
    area_state area; /* its plane is the atlas */
    blend_state *mix;
    int n, n_atlas_rows; /* triangles, and their rows */
    int32_t id[TL_ATLAS_TRIANGLES + TL_MAX_LANES], top[TL_ATLAS_TRIANGLES + TL_MAX_LANES],
        n_rows[TL_ATLAS_TRIANGLES + TL_MAX_LANES];
    /* in the window: the pixels of their first cells */
    int32_t col[TL_ATLAS_TRIANGLES + TL_MAX_LANES], row[TL_ATLAS_TRIANGLES + TL_MAX_LANES];
} area_pass;

/* ---- small triangles --------------------------------------------------------------------------------------------- */

/* Blends the triangles in the atlas, and clears it. */
static __attribute__((noinline)) void flush_atlas(area_pass *p)
{
    blend_state *b = p->mix;
    int32_t *cells = p->area.plane.cells + TL_CELL_PAD;
    for (int kind = 0; kind < TL_EDGES_NONE; kind++)
        if (p->area.n[kind])
            flush_edges(&p->area, kind, 1);
    flush_quads(&p->area.plane);
    lay_ground(b, b->window->height);
    for (int k = 0; k < p->n; k++) {
        const int64_t id = p->id[k];
        const int32_t row = p->row[k], col = p->col[k], next = k + 2 < p->n ? k + 2 : k;
        fetch_pixels(b, p->row[next] * b->stride + p->col[next], p->n_rows[next], 8);
        const int32_t first_row = row < 0 ? -row : 0, end_row = (int32_t)min64(p->n_rows[k], b->window->height - row);
        if (b->is_flat && !begin_flat(b, id))
            continue;
        if (!b->is_flat)
            begin_gouraud_of_mesh(b, id);
        blend_block(b, &(cell_block){
                           .cells = cells + (int64_t)(p->top[k] + first_row) * TL_ATLAS_COLS,
                           .at = (row + first_row) * b->stride + col,
                           .stride = TL_ATLAS_COLS,
                           .n_rows = end_row - first_row,
                           .first = col < 0 ? -col : 0,
                           .end = (int32_t)min64(TL_ATLAS_COLS, b->window->width - col),
                       });
    }
    for (int32_t k = 0; k < (p->n_atlas_rows + 2) * TL_ATLAS_COLS; k += TL_LANES)
        vi_store(cells + k, vi_set1(TL_CELL_ZERO));
    p->n = p->n_atlas_rows = 0;
}

/* Adds the triangles in m, which span n_rows pixels from (col, row) on, to the atlas. */
static void push_atlas(area_pass *p, vm m, const lane_corners *c, vm turned, vi id, vi col, vi row, vi n_rows)
{
    const tl_window *window = p->mix->window;
    const int bits = window->subpixel_bits;
    const vi rows = vi_select(m, n_rows, vi_set1(0)), ends = vi_add(vi_prefix_sum(rows), vi_set1(p->n_atlas_rows));
    const vi top = vi_sub(ends, rows);
    int32_t last[TL_MAX_LANES];
    vi_compress(p->id + p->n, m, id);
    vi_compress(p->top + p->n, m, top);
    vi_compress(p->n_rows + p->n, m, rows);
    vi_compress(p->col + p->n, m, vi_sub(col, vi_set1((int32_t)window->x_px)));
    p->n += vi_compress(p->row + p->n, m, vi_sub(row, vi_set1((int32_t)window->y_px)));
    vi_store(last, ends);
    p->n_atlas_rows = last[TL_LANES - 1];
    lane_corners moved = *c;
    const vi dx = vi_shift_left(col, bits), dy = vi_shift_left(vi_sub(row, top), bits);
    for (int k = 0; k < 3; k++) {
        moved.x[k] = vi_sub(c->x[k], dx);
        moved.y[k] = vi_sub(c->y[k], dy);
    }
    push_edges(&p->area, &moved, m, turned);
    if (p->n > TL_ATLAS_TRIANGLES - TL_LANES || p->n_atlas_rows > TL_ATLAS_ROWS - TL_ATLAS_COLS * TL_LANES)
        flush_atlas(p);
}

/* ---- the mesh ---------------------------------------------------------------------------------------------------- */

/* Setup and cull of TL_LANES triangles, which are drawn after all in the atlas. */
TL_INLINE void blend_area_batch(area_pass *p, int64_t i, const int32_t *corners, vm live)
{
    const tl_snapped *snapped = p->mix->snapped;
    const tl_window *window = p->mix->window;
    const int bits = window->subpixel_bits;
    const vi max_extent = vi_set1(TL_ATLAS_COLS << bits), id = vi_add(vi_set1((int32_t)i), vi_iota());
    if (has_bad_index(corners, vi_set1((int32_t)(snapped->mesh.n_vertices - 1)))) {
        p->area.bad_row = i;
        return;
    }
    lane_corners c;
    load_in_order(snapped, corners, &c);
    const lane_extents e = extents_of(&c);
    const vi col = vi_shift_right(e.x_min, bits), row = vi_shift_right(e.y_min, bits);
    const vi last_col = vi_shift_right(e.x_max, bits), last_row = vi_shift_right(e.y_max, bits);
    const vi n_cols = vi_sub(last_col, col), n_rows = vi_sub(last_row, row); /* one less than the number */
    /* the cell right of the last column holds the rest of its area */
    vm single = is_too_large(&e, max_extent);
    single = vm_or(single, vm_or(vi_gt(n_cols, vi_set1(TL_ATLAS_COLS - 2)), vi_gt(n_rows, vi_set1(TL_ATLAS_COLS - 1))));
    const vm is_special = vi_eq(e.x_min, vi_set1(TL_SPECIAL));
    const vi right = vi_set1((int32_t)min64(window->x_px + window->width, INT32_MAX));
    const vi bottom = vi_set1((int32_t)min64(window->y_px + window->height, INT32_MAX));
    const vm meets_cols = vm_and(vi_gt(right, col), vi_gt(last_col, vi_set1((int32_t)window->x_px - 1)));
    const vm meets_rows = vm_and(vi_gt(bottom, row), vi_gt(last_row, vi_set1((int32_t)window->y_px - 1)));
    const vm meets = vm_and(meets_cols, meets_rows);
    vm drawn = vm_and(vm_and_not(live, vm_or(single, is_special)), meets);
    single = vm_and(live, vm_or(is_special, vm_and(single, meets)));
    if (!vm_any(vm_or(drawn, single)))
        return;
    vm is_negative;
    drawn = vm_and(drawn, find_unculled(&c, snapped->cull, &is_negative));
    const vi rows = vi_add(n_rows, vi_set1(1));
    for (unsigned lanes = vm_bits(single); lanes; lanes &= lanes - 1) {
        const int lane = __builtin_ctz(lanes);
        const vm before = vm_first(lane);
        if (vm_any(vm_and(drawn, before)))
            push_atlas(p, vm_and(drawn, before), &c, is_negative, id, col, row, rows);
        drawn = vm_and_not(drawn, before);
        if (p->n)
            flush_atlas(p);
        if (tl_is_given_up(window))
            return;
        blend_area_single(p->mix, i + lane);
    }
    if (vm_any(drawn))
        push_atlas(p, drawn, &c, is_negative, id, col, row, rows);
}

/* The window has fewer than 2^31 samples. */
static int64_t blend_areas(blend_state *b)
{
    const tl_snapped *snapped = b->snapped;
    const tl_window *window = b->window,
                    atlas = {0, 0, TL_ATLAS_COLS, TL_ATLAS_ROWS, window->subpixel_bits, TL_TEST_SAMPLE, NULL};
    const int64_t far = (int64_t)1 << 30;
    if (window->x_px <= -far || window->x_px >= far || window->y_px <= -far || window->y_px >= far) {
        const int64_t bad_row = first_bad_row(snapped->triangles, snapped->n_triangles, snapped->mesh.n_vertices);
        for (int64_t i = 0; bad_row < 0 && i < snapped->n_triangles && !tl_is_given_up(window); i++)
            blend_area_single(b, i);
        lay_ground(b, window->height);
        return bad_row;
    }
    area_pass p;
    p.mix = b, p.n = p.n_atlas_rows = 0;
    place_plane(&atlas, &(tl_area){.cells = b->canvas->cells}, &p.area.plane);
    p.area.plane.stride = TL_ATLAS_COLS; /* an edge adds 0 right of a row */
    p.area.snapped = snapped, p.area.window = &atlas, p.area.bad_row = -1;
    memset(p.area.n, 0, sizeof p.area.n);
    const tl_slice all = {.first = 0, .end = snapped->n_triangles};
    int32_t corners[3 * TL_LANES];
    for (int64_t i = 0; i < all.end && p.area.bad_row < 0 && !tl_is_given_up(window); i += TL_LANES) {
        tl_count_work(window, TL_SETUP_PX * TL_LANES);
        blend_area_batch(&p, i, slice_corners(snapped, &all, i, corners), vm_first(all.end - i));
    }
    flush_atlas(&p);
    return p.area.bad_row;
}

#endif
