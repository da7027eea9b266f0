/* Lines: the edges of a mesh, each pixel of a line once, from the pixel of one end to the pixel of the other.
 * In: snapped vertices, pairs of them.  Out: 1 for each visible pixel of a line.
 * Based on: J. E. Bresenham, Algorithm for computer control of a digital plotter, 1965.
 *
 * A line of d steps along its longer side and q <= d across is, at step k, floor((q k + floor(d / 2)) / d) pixels
 * across: halves round up.  Floor divisions give the steps inside the window.  |x_px| < 2^62, so d < 2^63 and every
 * product of two of these is below 2^126; the remainder is below d and a step adds at most d, which fits 64 bits. */
#ifndef TL_LINES_C
#define TL_LINES_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "lines/edges.c"
#include "lines/smooth_lines.c"

/* longer lines are drawn one by one: lanes step together, and most lines of a mesh are short */
#define TL_MAX_STEPS 63

/* Pixels of the lines of several vectors: storing bytes next to the arithmetic would stall it. */
typedef struct {
    const tl_edges *lines;
    const tl_window *window;
    const tl_line_target *target;
    int has_depth;
    int32_t n;
    int32_t at[TL_MAX_PIXELS + TL_MAX_LANES], z[TL_MAX_PIXELS + TL_MAX_LANES]; /* z: the bits of a float */
} line_state;

static inline void put_pixel(const line_state *s, int64_t at, float z)
{
    if (!s->has_depth || shows_depth(s->target, at, z))
        ((uint8_t *)s->target->pixels)[at] = 1;
}

static void flush_plain(line_state *s)
{
    uint8_t *restrict pixels = s->target->pixels;
    for (int32_t k = 0; k < s->n; k++)
        pixels[(uint32_t)s->at[k]] = 1;
    s->n = 0;
}

/* Without a branch: hidden pixels are unpredictable; a third of the time. */
static void flush_hidden(line_state *s)
{
    const tl_line_target own = *s->target, *target = &own; /* a copy that no store can alias */
    uint8_t *restrict pixels = target->pixels;
    const int32_t *restrict at = s->at, *restrict z_bits = s->z, n = s->n;
    for (int32_t k = 0; k < n; k++) {
        float z;
        memcpy(&z, z_bits + k, sizeof z);
        pixels[(uint32_t)at[k]] |= (uint8_t)shows_depth(target, (uint32_t)at[k], z);
    }
    s->n = 0;
}

static void flush_pixels(line_state *s)
{
    if (s->has_depth)
        flush_hidden(s);
    else
        flush_plain(s);
}

/* The steps [first, last] of a line that are inside the window. */
typedef struct {
    int64_t first, last;
} step_range;

/* The steps along the longer side inside [0, extent): the line starts at u0, and each step adds +1 or -1. */
static inline step_range steps_along(int64_t u0, int direction, int64_t extent, int64_t d)
{
    if (direction > 0)
        return (step_range){max64(0, -u0), min64(d, extent - 1 - u0)};
    return (step_range){max64(0, u0 - (extent - 1)), min64(d, u0)};
}

/* floor((a b + c) / q) for q > 0. */
static inline int64_t floor_of_share(int64_t a, int64_t b, int64_t c, int64_t q)
{
    tl_int128 quotient, rest;
    i128_floor_divide(i128_add(i128_product(a, b), i128_from(c)), i128_from(q), &quotient, &rest);
    return i128_low(quotient);
}

/* The steps of r at which the line is inside across: at step k it is at v0 + direction * floor((q k + d / 2) / d). */
static inline step_range steps_across(step_range r, int64_t v0, int direction, int64_t extent, int64_t d, int64_t q)
{
    const int64_t low = direction > 0 ? -v0 : v0 - (extent - 1), high = direction > 0 ? extent - 1 - v0 : v0;
    if (high < 0 || low > q)
        return (step_range){0, -1};
    if (low > 0) /* rounded up */
        r.first = max64(r.first, floor_of_share(low, d, q - 1 - d / 2, q));
    if (high < q)
        r.last = min64(r.last, floor_of_share(high + 1, d, -1 - d / 2, q));
    return r;
}

/* Draws one line with any ends. */
static void draw_line(const line_state *s, const int32_t *edge)
{
    const tl_window *w = s->window;
    const int bits = w->subpixel_bits;
    line_end ends[2];
    if (!find_ends(s->lines, edge, ends))
        return;
    const int64_t x0 = (ends[0].x_fx >> bits) - w->x_px, y0 = (ends[0].y_fx >> bits) - w->y_px;
    const int64_t dx = (ends[1].x_fx >> bits) - (ends[0].x_fx >> bits);
    const int64_t dy = (ends[1].y_fx >> bits) - (ends[0].y_fx >> bits);
    const int64_t size_x = dx < 0 ? -dx : dx, d = max64(size_x, dy), q = min64(size_x, dy);
    const int64_t stride = s->target->stride_px;
    const int is_steep = dy > size_x, right = dx < 0 ? -1 : 1;
    step_range r = is_steep ? steps_along(y0, 1, w->height, d) : steps_along(x0, right, w->width, d);
    r = is_steep ? steps_across(r, x0, right, w->width, d, q) : steps_across(r, y0, 1, w->height, d, q);
    tl_count_work(w, TL_SETUP_PX + 4 * max64(0, r.last - r.first)); /* a pixel counts as four pixels of a row */
    if (r.first > r.last)
        return;
    tl_int128 steps = i128_from(0), left = i128_from(0);
    if (d)
        i128_floor_divide(i128_add(i128_product(q, r.first), i128_from(d / 2)), i128_from(d), &steps, &left);
    const int64_t taken = i128_low(steps);
    uint64_t rest = (uint64_t)i128_low(left);
    const int64_t x = x0 + right * (is_steep ? taken : r.first), y = y0 + (is_steep ? r.first : taken);
    const int64_t along = is_steep ? stride : right, aside = is_steep ? right : stride;
    const double slope = d ? (ends[1].z - ends[0].z) / (double)d : 0.0;
    int64_t at = y * stride + x;
    for (int64_t k = r.first; k <= r.last; k++) {
        put_pixel(s, at, (float)(ends[0].z + (double)k * slope));
        rest += (uint64_t)q;
        const int64_t turn = -(int64_t)(rest >= (uint64_t)d); /* without a branch: it is unpredictable */
        rest -= (uint64_t)(d & turn);
        at += along + (aside & turn);
    }
}

/* TL_LANES lines inside the window. */
typedef struct {
    vi x, y, steps, across, along, aside; /* along, aside: added to the index of a pixel by a step */
    vd z, slope;
} lane_lines;

/* Steps all lines together and lists their pixels. */
TL_INLINE void walk_lines(line_state *s, const lane_lines *l, vm live, int has_depth)
{
    const vi one = vi_set1(1), none = vi_set1(-1), last = vi_sub(l->steps, one), across = l->across, along = l->along;
    const vi aside = l->aside;
    vi at = vi_add(vi_mul(l->y, vi_set1((int32_t)s->target->stride_px)), l->x), rest = vi_shift_right(l->steps, 1);
    vi left = vi_select(live, l->steps, none);
    vm on = vi_gt(left, none);
    int32_t n = s->n;
    for (int k = 0; vm_any(on); k++) {
        vi_compress(s->at + n, on, at);
        if (has_depth) {
            const vf z = vf_from_vd(vd_add(l->z, vd_mul(vd_set1((double)k), l->slope)));
            vi_compress(s->z + n, on, vi_bits_of_vf(z));
        }
        n += __builtin_popcount(vm_bits(on));
        rest = vi_add(rest, across);
        at = vi_add(at, along);
        const vm turn = vi_gt(rest, last);
        rest = vi_select(turn, vi_sub(rest, l->steps), rest);
        at = vi_select(turn, vi_add(at, aside), at);
        left = vi_sub(left, one);
        on = vi_gt(left, none);
    }
    s->n = n;
}

/* Draws the lines of TL_LANES edges, of which `live` exist; `edges` holds TL_LANES pairs.  The gain beside `draw_line`
 * alone is 2.5 on the median, 1.8 with depth: wireframes of 1,000 to 1,000,000 triangles, 256x256 to 2048x2048, AVX2 of
 * a Zen 3. */
TL_INLINE void draw_lanes(line_state *s, const int32_t *edges, vm live, int has_depth)
{
    const tl_vertex *v = s->lines->mesh.vertices;
    const tl_window *w = s->window;
    const int bits = w->subpixel_bits;
    const vi zero = vi_set1(0), one = vi_set1(1), special = vi_set1(TL_SPECIAL);
    vi x0, y0, x1, y1;
    vz z0, z1;
    load_vertices_by(2, v, edges, &x0, &y0, &z0);
    load_vertices_by(2, v, edges + 1, &x1, &y1, &z1);
    const vm is_special = vm_or(vi_eq(x0, special), vi_eq(x1, special));
    const vm swap = vm_or(vi_gt(y0, y1), vm_and(vi_eq(y0, y1), vi_gt(x0, x1)));
    const vi dx = vi_set1((int32_t)w->x_px), dy = vi_set1((int32_t)w->y_px);
    const vi from_x = vi_sub(vi_shift_right(vi_select(swap, x1, x0), bits), dx);
    const vi to_x = vi_sub(vi_shift_right(vi_select(swap, x0, x1), bits), dx);
    const vi from_y = vi_sub(vi_shift_right(vi_select(swap, y1, y0), bits), dy);
    const vi to_y = vi_sub(vi_shift_right(vi_select(swap, y0, y1), bits), dy);
    const vi last_x = vi_set1((int32_t)w->width - 1), last_y = vi_set1((int32_t)w->height - 1);
    const vm above = vm_or(vi_gt(zero, to_y), vi_gt(from_y, last_y));
    const vm beside = vm_or(vi_gt(zero, vi_max(from_x, to_x)), vi_gt(vi_min(from_x, to_x), last_x));
    const vm astride = vm_or(vm_or(vi_gt_unsigned(from_x, last_x), vi_gt_unsigned(to_x, last_x)),
                             vm_or(vi_gt_unsigned(from_y, last_y), vi_gt_unsigned(to_y, last_y)));
    const vi right = vi_sub(to_x, from_x), down = vi_sub(to_y, from_y), size_x = vi_max(right, vi_sub(zero, right));
    const vm is_left = vi_gt(zero, right), is_steep = vi_gt(down, size_x);
    lane_lines l = {.x = from_x, .y = from_y, .steps = vi_max(size_x, down), .across = vi_min(size_x, down)};
    const vm outside = vm_and_not(vm_or(above, beside), is_special);
    const vm alone = vm_or(is_special, vm_or(astride, vi_gt(l.steps, vi_set1(TL_MAX_STEPS))));
    live = vm_and_not(live, outside);
    tl_count_work(w, TL_SETUP_PX * TL_LANES);
    for (unsigned rest = vm_bits(vm_and(live, alone)); rest; rest &= rest - 1)
        draw_line(s, edges + 2 * __builtin_ctz(rest));
    const vi sideways = vi_select(is_left, vi_set1(-1), one), stride = vi_set1((int32_t)s->target->stride_px);
    l.along = vi_select(is_steep, stride, sideways);
    l.aside = vi_select(is_steep, sideways, stride);
    if (has_depth) {
        const vd a = vd_from_vz(z0), b = vd_from_vz(z1);
        l.z = vd_select(swap, b, a);
        l.slope = vd_div(vd_sub(vd_select(swap, a, b), l.z), vd_from_vi(vi_max(l.steps, one)));
    }
    walk_lines(s, &l, vm_and_not(live, alone), has_depth);
    if (s->n > TL_MAX_PIXELS - TL_MAX_LANES * (TL_MAX_STEPS + 1))
        flush_pixels(s);
}

TL_INLINE void draw_all_lines(line_state *s, int has_depth)
{
    const int64_t n = s->lines->n_edges;
    int64_t i = 0;
    for (; !is_near(s->window) && i < n && !tl_is_given_up(s->window); i++)
        draw_line(s, s->lines->edges + 2 * i);
    for (; i < n && !tl_is_given_up(s->window); i += TL_LANES) {
        const int32_t *edges = s->lines->edges + 2 * i;
        int32_t last[2 * TL_MAX_LANES];
        for (int k = 0; i + TL_LANES > n && k < 2 * TL_LANES; k++)
            last[k] = s->lines->edges[2 * min64(i + k / 2, n - 1) + k % 2];
        draw_lanes(s, i + TL_LANES > n ? last : edges, vm_first(n - i), has_depth);
    }
    flush_pixels(s);
}

static void draw_lines(const tl_edges *lines, const tl_window *window, const tl_line_target *target)
{
    const int64_t rows_at_once = max64(1, (((int64_t)1 << 31) - 1) / target->stride_px);
    for (int64_t row = 0; row < window->height; row += rows_at_once) {
        tl_window band = *window;
        tl_line_target part = *target;
        band.y_px += row;
        band.height = min64(rows_at_once, window->height - row);
        part.pixels = (char *)target->pixels + row * target->stride_px * (target->is_smooth ? 4 : 1);
        part.depth = target->depth ? target->depth + row * target->stride_px : NULL;
        if (target->is_smooth) {
            draw_smooth_lines(lines, &band, &part);
            continue;
        }
        line_state s = {.lines = lines, .window = &band, .target = &part, .has_depth = part.depth != NULL};
        for (int64_t k = 0; k < band.height; k++)
            memset((uint8_t *)part.pixels + k * part.stride_px, 0, (size_t)band.width);
        if (s.has_depth)
            draw_all_lines(&s, 1);
        else
            draw_all_lines(&s, 0);
    }
}

#endif
