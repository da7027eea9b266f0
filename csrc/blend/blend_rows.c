/* Blend, by area: the rows of a large flat triangle that two edges cross from top to bottom, a vector of rows at a
 * time.
 * In: a triangle.  Out: uint8 pixels; other rows are drawn by blend_strip.c.
 *
 * Such a row is a ramp on the left, a run of whole pixels and a ramp on the right.  The ramps are those of ramp.c
 * without cells: where they share no pixel, each ramp is the area. */
#ifndef TL_BLEND_ROWS_C
#define TL_BLEND_ROWS_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "vertex/setup.c"
#include "sink/pixel_runs.c"
#include "area/area.c"
#include "area/ramp.c"
#include "blend/blend_strip.c"
#include "blend/mix.c"
#include "blend/mix.h"
#include "blend/mix_u8.c"

/* Fewer rows or columns are not faster this way. */
#define TL_ROWS_AT_LEAST 32

/* An edge, and a vector of its rows. */
typedef struct {
    edge_one edge;
    int64_t top_fx, bottom_fx;
    int n_quads; /* groups of four pixels that a row crosses; 0: too many */
    vi col, areas[8];
} blend_side;

static blend_side place_side(const area_plane *plane, const tl_triangle *t, int k)
{
    const int next = k == 2 ? 0 : k + 1, is_down = t->y_fx[k] < t->y_fx[next], bits = plane->bits;
    const int upper = is_down ? k : next, lower = is_down ? next : k;
    const int64_t dx = t->x_fx[lower] - t->x_fx[upper], dy = t->y_fx[lower] - t->y_fx[upper];
    const int64_t width = max64(dx, -dx);
    blend_side s = {.top_fx = t->y_fx[upper], .bottom_fx = t->y_fx[lower]};
    if (dy == 0 || width > 6 * dy ||
        !is_lane_edge(t->x_fx[upper], t->y_fx[upper], t->x_fx[lower], t->y_fx[lower], max_edge_extent(bits)))
        return s;
    s.n_quads = width > 2 * dy ? 2 : 1;
    const edge_record record = {(int32_t)t->x_fx[upper], (int32_t)t->y_fx[upper], (int32_t)dx,
                                (int32_t)(is_down ? -dy : dy)};
    s.edge = setup_edge(plane, &record);
    return s;
}

/* Sets the ramps of the rows from `row` on of an edge that crosses all of them. */
TL_INLINE void find_ramps(blend_side *s, int n_quads, int64_t row, int bits)
{
    const edge_one *e = &s->edge;
    const vi unit = vi_set1(1 << bits), t = vi_add(vi_set1((int32_t)(e->t + (row - e->row) * ((int64_t)1 << bits))),
                                                   vi_shift_left(vi_iota(), bits));
    const vd x = vd_set1(e->x), slope = vd_set1(e->slope);
    const vd xa = vd_add(x, vd_mul(vd_from_vi(t), slope));
    const vd xb = vd_add(x, vd_mul(vd_from_vi(vi_add(t, unit)), slope));
    const vd height = vd_mul(vd_from_vi(unit), vd_set1(e->height));
    s->col = vi_add(vi_set1(e->col), ramp_areas(n_quads, xa, xb, vd_set1(e->steep), height, s->areas));
}
static __attribute__((noinline)) void find_steep_ramps(blend_side *s, int64_t row, int bits)
{
    find_ramps(s, 1, row, bits);
}
static __attribute__((noinline)) void find_flat_ramps(blend_side *s, int64_t row, int bits)
{
    find_ramps(s, 2, row, bits);
}

/* Blends pixels [4 q, 4 q + 4) of a side from at[k] on, k < n rows. */
TL_INLINE void mix_ramps(blend_state *b, const blend_side *s, int q, int32_t base, const int32_t *at, int n,
                         tl_mix mode)
{
    const vi color = vi_set1(b->color);
    const vm rows = vm_first(n);
    int32_t mixed[4 * TL_MAX_LANES];
    vi pixels[4];
    vi_load_records(b->packed + 4 * q, 4, at, pixels);
    for (int k = 0; k < 4; k++) {
        const vi area = vi_min(vi_add(vi_set1(base), s->areas[4 * q + k]), vi_set1(TL_WHOLE));
        const vm on = vm_and(rows, vi_gt(area, vi_set1(0)));
        if (vm_any(on))
            pixels[k] = vi_select(on, mix_area_u8(pixels[k], color, area, on, mode, b->whole_mode), pixels[k]);
    }
    vi_store_quads(mixed, pixels);
    for (int k = 0; k < TL_LANES && k < n; k++)
        v4_store(b->packed + at[k] + 4 * q, v4_load(mixed + 4 * vi_quad_slot(k)));
}

/* Blends at most n rows from `row` on, which both sides cross.  Returns the number of rows drawn; or minus the number
 * of rows where the sides share pixels, or reach beyond the window, which are not drawn. */
TL_INLINE int blend_between(blend_state *b, const area_plane *plane, blend_side *left, blend_side *right, int64_t row,
                            int n, tl_mix mode)
{
    blend_side *const sides[2] = {left, right};
    int32_t first[TL_MAX_LANES], at[2][TL_MAX_LANES];
    for (int k = 0; k < 2; k++) {
        if (sides[k]->n_quads == 1)
            find_steep_ramps(sides[k], row, plane->bits);
        else
            find_flat_ramps(sides[k], row, plane->bits);
    }
    const vi zero = vi_set1(0), from = vi_add(left->col, vi_set1(4 * left->n_quads)), to = right->col;
    const vm reaches =
        vm_or(vi_gt(zero, left->col), vi_gt(vi_add(to, vi_set1(4 * right->n_quads)), vi_set1(plane->n_cols)));
    const unsigned bad = vm_bits(vm_and(vm_first(n), vm_or(reaches, vi_gt(from, to))));
    if (bad & 1) {
        const unsigned good = ~bad;
        return -(int)min64(n, __builtin_ctz(good));
    }
    n = bad ? __builtin_ctz(bad) : n;
    const vi rows = vi_add(vi_set1((int32_t)(row * b->stride)), vi_mul(vi_iota(), vi_set1((int32_t)b->stride)));
    const vm drawn = vm_first(n);
    const vi base = vi_set1((int32_t)(row * b->stride));
    vi_store(at[0], vi_select(drawn, vi_add(rows, left->col), base));
    vi_store(at[1], vi_select(drawn, vi_add(rows, to), base));
    vi_store(first, vi_add(rows, from));
    const int is_laid_beside = b->n_laid <= row;
    int32_t over_ground[TL_MAX_LANES];
    if (is_laid_beside)
        vi_store(over_ground, mix_whole_u8(vi_set1(b->ground), vi_set1(b->color), vm_all(), b->whole_mode));
    lay_ground(b, is_laid_beside ? row : row + n);
    for (int k = 0; k < n; k++) {
        const int64_t start = (row + k) * b->stride, end = start + plane->n_cols;
        if (!is_laid_beside) {
            mix_pixels(b, first[k], at[1][k] - first[k]);
            continue;
        }
        /* from left to right: writing right of the triangle first takes 1.6 times as long */
        if (first[k] > start)
            put_words(b->packed + start, first[k] - start, b->ground, 0);
        put_words(b->packed + first[k], at[1][k] - first[k], over_ground[0], 0);
        if (at[1][k] < end)
            put_words(b->packed + at[1][k], end - at[1][k], b->ground, 0);
    }
    b->n_laid = max64(b->n_laid, row + n);
    for (int k = 0; k < 2; k++)
        for (int q = 0; q < sides[k]->n_quads; q++)
            mix_ramps(b, sides[k], q, k ? TL_WHOLE : 0, at[k], n, mode);
    return n;
}

static __attribute__((noinline)) int blend_some_rows(blend_state *b, const area_plane *plane, blend_side *left,
                                                     blend_side *right, int64_t row, int n)
{
    if (b->mode == TL_MIX_OVER_STRAIGHT)
        return blend_between(b, plane, left, right, row, n, TL_MIX_OVER_STRAIGHT);
    return blend_between(b, plane, left, right, row, n, b->mode);
}

/* Blends rows [first_row, end_row) of the window, of a triangle with narrow vertices. */
static __attribute__((noinline)) void blend_rows_of(blend_state *b, const tl_triangle *t, int64_t first_row,
                                                    int64_t end_row, int strip)
{
    const tl_window *window = b->window;
    const int bits = window->subpixel_bits;
    const int64_t unit = (int64_t)1 << bits;
    area_plane plane;
    blend_side sides[3];
    place_plane(window, &(tl_area){.cells = b->canvas->cells}, &plane);
    for (int k = 0; k < 3; k++)
        sides[k] = place_side(&plane, t, k);
    int64_t row = first_row, left_from = first_row;
    while (row < end_row) {
        const int64_t top = (row + window->y_px) * unit;
        blend_side *passed[2] = {NULL, NULL};
        int64_t end = end_row;
        for (int k = 0; k < 3; k++) {
            blend_side *s = sides + k;
            if (!s->n_quads || s->top_fx > top || s->bottom_fx < top + unit)
                continue;
            passed[s->edge.height < 0] = s;
            end = min64(end, (s->bottom_fx >> bits) - window->y_px);
        }
        int n = -1;
        if (passed[0] && passed[1])
            n = blend_some_rows(b, &plane, passed[0], passed[1], row, (int)min64(end - row, TL_LANES));
        if (n < 0) {
            row -= n;
            continue;
        }
        for (; left_from < row; left_from += strip)
            blend_strip(b, t, 1, left_from, (int)min64(strip, row - left_from));
        row += n;
        left_from = row;
    }
    for (; left_from < end_row; left_from += strip)
        blend_strip(b, t, 1, left_from, (int)min64(strip, end_row - left_from));
}

/* Blends triangle i, with all of its pieces, by itself. */
static __attribute__((noinline)) void blend_area_single(blend_state *b, int64_t i)
{
    const tl_window *window = b->window;
    int32_t own[3];
    const triangle_parts parts = parts_of(b->snapped, i, own);
    int64_t n = 0, top = INT64_MAX, bottom = INT64_MIN, left = INT64_MAX, right = INT64_MIN;
    int is_narrow = 1;
    tl_triangle t[TL_MAX_PIECES];
    for (int k = 0; k < parts.n && n < TL_MAX_PIECES; k++) {
        if (is_culled(load_triangle(&parts.set, parts.corners + 3 * k, t + n), b->snapped->cull))
            continue;
        top = min64(top, min3(t[n].y_fx[0], t[n].y_fx[1], t[n].y_fx[2]) >> window->subpixel_bits);
        bottom = max64(bottom, max3(t[n].y_fx[0], t[n].y_fx[1], t[n].y_fx[2]) >> window->subpixel_bits);
        left = min64(left, min3(t[n].x_fx[0], t[n].x_fx[1], t[n].x_fx[2]) >> window->subpixel_bits);
        right = max64(right, max3(t[n].x_fx[0], t[n].x_fx[1], t[n].x_fx[2]) >> window->subpixel_bits);
        is_narrow &= t[n].is_narrow;
        n++;
    }
    if (!n)
        return;
    const int64_t first_row = max64(top - window->y_px, 0);
    const int64_t end_row = min64(bottom + 1 - window->y_px, window->height);
    if (first_row >= end_row || (b->is_flat && !begin_flat(b, i)))
        return;
    if (!b->is_flat)
        begin_gouraud(b, i, &parts.set, parts.corners, parts.is_cut);
    /* strips of triangles with wide vertices are as wide as the window */
    const int n_rows = strip_rows(is_narrow ? min64(window->width, right - left + 4) : window->width);
    tl_count_work(window, 4 * (end_row - first_row) * (16 + min64(window->width, right - left)));
    if (TL_LANES > 1 && n == 1 && is_narrow && b->is_flat && b->canvas->is_u8 && is_near(window) &&
        min64(end_row - first_row, right - left) >= TL_ROWS_AT_LEAST) {
        blend_rows_of(b, t, first_row, end_row, n_rows);
        return;
    }
    for (int64_t row = first_row; row < end_row; row += n_rows)
        blend_strip(b, t, n, row, (int)min64(n_rows, end_row - row));
}

#endif
