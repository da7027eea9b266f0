/* Bin: which triangles reach into which bands of rows, so that a mesh is set up once for many samples and bands.
 * In: vertex records and triangles.  Out: the triangles in the window, and the first and last band of each.
 *
 * A triangle is listed when the centre of a pixel of the window lies within reach_fx of its extent, in x and in y: more
 * triangles than cover a sample.  Bands are 2^band_bits rows tall. */
#ifndef TL_BIN_C
#define TL_BIN_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/clip.c"
#include "vertex/fixed.h"
#include "vertex/setup.c"
#include "raster/triangles_fixed.c"

typedef struct {
    const tl_snapped *snapped;
    const tl_window *window;
    int32_t low_fx, high_fx; /* added to the ends of an extent before rounding to pixels */
    int band_bits;
    int32_t max_extent, left, top, right, bottom;
} bin_limits;

/* Rows of the window; none unless first < end. */
typedef struct {
    int64_t first, end;
} bin_rows;

/* Widens rows by those that a triangle may reach. */
static void widen_bin(const bin_limits *b, const tl_vertex_set *set, const int32_t *corners, bin_rows *rows)
{
    const tl_window *window = b->window;
    const int bits = window->subpixel_bits;
    tl_triangle t;
    const int sign = load_triangle(set, corners, &t);
    if (is_culled(sign, b->snapped->cull))
        return;
    const int64_t x0 = min3(t.x_fx[0], t.x_fx[1], t.x_fx[2]), x1 = max3(t.x_fx[0], t.x_fx[1], t.x_fx[2]);
    const int64_t y0 = min3(t.y_fx[0], t.y_fx[1], t.y_fx[2]), y1 = max3(t.y_fx[0], t.y_fx[1], t.y_fx[2]);
    const int64_t col0 = max64(((x0 + b->low_fx) >> bits) - window->x_px, 0);
    const int64_t col1 = min64(((x1 + b->high_fx) >> bits) - window->x_px, window->width);
    const int64_t row0 = max64(((y0 + b->low_fx) >> bits) - window->y_px, 0);
    const int64_t row1 = min64(((y1 + b->high_fx) >> bits) - window->y_px, window->height);
    if (col0 >= col1 || row0 >= row1)
        return;
    rows->first = min64(rows->first, row0), rows->end = max64(rows->end, row1);
}

/* Lists triangle i, with all of its pieces, by itself. */
static __attribute__((noinline)) void bin_alone(const bin_limits *b, int64_t i, tl_bins *bins)
{
    int32_t own[3];
    const triangle_parts parts = parts_of(b->snapped, i, own);
    bin_rows rows = {b->window->height, 0};
    for (int k = 0; k < parts.n; k++)
        widen_bin(b, &parts.set, parts.corners + 3 * k, &rows);
    if (rows.first >= rows.end)
        return;
    bins->ids[bins->n] = (int32_t)i;
    bins->first_band[bins->n] = (int32_t)(rows.first >> b->band_bits);
    bins->last_band[bins->n] = (int32_t)((rows.end - 1) >> b->band_bits);
    bins->n++;
}

TL_INLINE int bin_batch(const bin_limits *b, int64_t i, const int32_t *corners, vm live, tl_bins *bins)
{
    const int bits = b->window->subpixel_bits;
    const vi zero = vi_set1(0);
    if (has_bad_index(corners, vi_set1((int32_t)(b->snapped->mesh.n_vertices - 1))))
        return 0;
    lane_corners c;
    load_in_order(b->snapped, corners, &c);
    const lane_extents e = extents_of(&c);
    const vm single = vm_and(live, is_single(&e, vi_set1(b->max_extent), TL_SPECIAL));
    for (unsigned lanes = vm_bits(single); lanes; lanes &= lanes - 1)
        bin_alone(b, i + __builtin_ctz(lanes), bins);
    const vi area = area_lanes(&c);
    const vm turned = not_culled(b->snapped->cull, vi_gt(area, zero), vi_gt(zero, area));
    const vi col0 = vi_max(vi_shift_right(vi_add(e.x_min, vi_set1(b->low_fx)), bits), vi_set1(b->left));
    const vi col1 = vi_min(vi_shift_right(vi_add(e.x_max, vi_set1(b->high_fx)), bits), vi_set1(b->right));
    const vi row0 = vi_max(vi_shift_right(vi_add(e.y_min, vi_set1(b->low_fx)), bits), vi_set1(b->top));
    const vi row1 = vi_min(vi_shift_right(vi_add(e.y_max, vi_set1(b->high_fx)), bits), vi_set1(b->bottom));
    const vm seen = vm_and(vm_and(vm_and_not(live, single), turned), vm_and(vi_gt(col1, col0), vi_gt(row1, row0)));
    const vi first = vi_sub(row0, vi_set1(b->top)), last = vi_sub(vi_sub(row1, vi_set1(1)), vi_set1(b->top));
    vi_compress(bins->ids + bins->n, seen, vi_add(vi_set1((int32_t)i), vi_iota()));
    vi_compress(bins->first_band + bins->n, seen, vi_shift_right(first, b->band_bits));
    vi_compress(bins->last_band + bins->n, seen, vi_shift_right(last, b->band_bits));
    bins->n += __builtin_popcount(vm_bits(seen));
    return 1;
}

static int64_t bin(const tl_snapped *snapped, const tl_window *window, int32_t reach_fx, int band_bits, tl_bins *bins)
{
    const int bits = window->subpixel_bits;
    const int64_t farthest = (int64_t)1 << 30;
    const extent_rounding round = round_extent(window);
    const bin_limits b = {
        .snapped = snapped,
        .window = window,
        .low_fx = round.first - reach_fx,
        .high_fx = round.end + reach_fx,
        .band_bits = band_bits,
        .max_extent = TL_MAX_BOX_PX << (bits < 8 ? bits : 8),
        .left = (int32_t)window->x_px,
        .top = (int32_t)window->y_px,
        .right = (int32_t)min64(window->x_px + window->width, farthest),
        .bottom = (int32_t)min64(window->y_px + window->height, farthest),
    };
    const tl_slice all = {.end = snapped->n_triangles};
    int32_t corners[3 * TL_LANES];
    bins->n = 0;
    for (int64_t i = 0; i < snapped->n_triangles; i += TL_LANES)
        if (!bin_batch(&b, i, slice_corners(snapped, &all, i, corners), vm_first(snapped->n_triangles - i), bins))
            return i;
    return -1;
}

static void list_bins(const tl_bins *bins, int64_t n_bands, int64_t *starts, int32_t *listed)
{
    if (!listed) {
        memset(starts, 0, sizeof(int64_t) * (size_t)(n_bands + 2));
        for (int64_t i = 0; i < bins->n; i++)
            for (int32_t k = bins->first_band[i]; k <= bins->last_band[i]; k++)
                starts[k + 2]++;
        for (int64_t k = 0; k < n_bands; k++)
            starts[k + 2] += starts[k + 1];
        return;
    }
    for (int64_t i = 0; i < bins->n; i++) /* starts[k + 1] is the next free place of band k */
        for (int32_t k = bins->first_band[i]; k <= bins->last_band[i]; k++)
            listed[starts[k + 1]++] = bins->ids[i];
}

#endif
