/* Texture lookups of pixels, in lanes: levels, and the texels of a level around a point with their shares.
 * In: coordinates, footprints, biases.  Out: rows of texels, shares, derivatives of the shares.
 *
 * All of it is float64: a texel of 2^-12 of a picture and its share need more digits than float32 has. */
#ifndef TL_GRAD_LOOKS_C
#define TL_GRAD_LOOKS_C

#include <float.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "grad/cube.c"
#include "grad/grad.h"
#include "grad/pixels.h"
#include "lanes/lanes.h"

/* Lookups of TL_LANES pixels. */
typedef struct {
    vm is_there; /* pixels with a lookup */
    vi low;      /* the level, or the lower of two levels */
    vd upper;    /* share of the upper level */
    vd uv[2];
    vm is_kept[2]; /* whether u, v are finite */
    vd by[4];      /* derivatives of the level by the slopes of u and v */
    cube_point cube;
} look_lanes;

/* Texels of a level: their rows, shares, and the derivatives of the shares by u and by v. */
typedef struct {
    int n;
    vi row[4];
    vd share[4], by[2][4];
} texel_shares;

/* Loads at most four numbers of a tensor (n_rows, stride) from `first` on, of the rows in lanes, as columns.  Rows at
 * the end of the tensor are copied first, because a vector load would read beyond it. */
TL_ONCE void copy_last_rows(const void *p, int64_t stride, int64_t first, const int32_t *rows, void *copy, int is_f64)
{
    const int64_t n = stride - first < 4 ? stride - first : 4;
    const size_t size = is_f64 ? sizeof(double) : sizeof(float);
    memset(copy, 0, 4 * TL_LANES * size);
    for (int k = 0; k < TL_LANES; k++)
        memcpy((char *)copy + 4 * k * size, (const char *)p + (size_t)(stride * rows[k] + first) * size, n * size);
}
TL_INLINE void load_look_rows(const void *p, int64_t n_rows, int64_t stride, int64_t first, vi row, vd *columns,
                              int is_f64)
{
    const int64_t beyond = first + 4 - stride; /* numbers read past the end of a row */
    double copy[4 * TL_MAX_LANES];
    int32_t rows[TL_MAX_LANES];
    vi bits[4];
    vi_spill(rows, row);
    if (beyond > 0 && vm_any(vi_gt(row, vi_set1(clamped_to_int(n_rows - 1 - beyond))))) {
        copy_last_rows(p, stride, first, rows, copy, is_f64);
        p = copy, stride = 4, first = 0;
        vi_spill(rows, vi_iota());
    }
    if (is_f64) {
        vd_load_records((const double *)p + first, (int)stride, rows, columns);
        return;
    }
    vi_load_records((const float *)p + first, (int)(4 * stride), rows, bits);
    for (int k = 0; k < 4; k++)
        columns[k] = vd_from_vf(vf_of_bits(bits[k]));
}

/* Writes n numbers of rows of `stride`, for the lanes in m, from columns. */
TL_INLINE void store_look_rows(void *p, int64_t stride, int64_t first, int n, vm m, const vd *columns, int is_f64)
{
    double numbers[6][TL_MAX_LANES];
    for (int c = 0; c < n; c++)
        vd_store(numbers[c], columns[c]);
    for (int k = 0; k < TL_LANES; k++)
        for (int c = 0; (vm_bits(m) >> k & 1) && c < n; c++)
            put_real(p, stride * k + first + c, numbers[c][k], is_f64);
}

/* log2 of numbers from 2^-100 to 2^120, by ln(m) = 2 atanh((m - 1) / (m + 1)), m from sqrt(1/2) to sqrt(2): log2 of C
 * libraries differs from processor to processor. */
TL_INLINE vd log2_of_lanes(vd a)
{
    const vd inverse = vd_power(a, UINT64_C(0x7fe0000000000000), UINT64_C(0x7ff0000000000000)); /* a power of 2 */
    vi exponent = vi_sub(vi_set1(127), vi_shift_right(vi_bits_of_vf(vf_from_vd(inverse)), 23));
    vd m = vd_mul(a, inverse), sum = vd_set1(0.0);
    const vm is_large = vd_ge(m, vd_set1(0x1.6a09e667f3bcdp0));
    m = vd_select(is_large, vd_mul(m, vd_set1(0.5)), m);
    exponent = vi_add(exponent, vi_select(is_large, vi_set1(1), vi_set1(0)));
    const vd s = vd_div(vd_sub(m, vd_set1(1.0)), vd_add(m, vd_set1(1.0))), square = vd_mul(s, s);
    for (int k = 23; k > 0; k -= 2)
        sum = vd_add(vd_mul(sum, square), vd_set1(1.0 / k));
    return vd_add(vd_from_vi(exponent), vd_mul(vd_mul(s, sum), vd_set1(2.8853900817779268))); /* 2 / ln 2 */
}

/* The mipmap level of the longer axis of footprints, 2^60 texels at most, and its derivatives by each slope. */
TL_INLINE vd footprint_level(const tl_grad_texture *t, const vd *slopes, vd *by)
{
    const vd w = vd_set1((double)t->widths[0]), h = vd_set1((double)t->heights[0]);
    const vd half = vd_set1(0.5), two = vd_set1(2.0), zero = vd_set1(0.0), least = vd_set1(1e-30);
    const vd s[2] = {vd_mul(slopes[0], w), vd_mul(slopes[1], w)}, r[2] = {vd_mul(slopes[2], h), vd_mul(slopes[3], h)};
    const vd a = vd_add(vd_mul(s[0], s[0]), vd_mul(r[0], r[0])), b = vd_add(vd_mul(s[1], s[1]), vd_mul(r[1], r[1]));
    const vd c = vd_add(vd_mul(s[0], s[1]), vd_mul(r[0], r[1])), e = vd_mul(vd_sub(a, b), half);
    const vd under = vd_add(vd_mul(e, e), vd_mul(c, c)), root = vd_sqrt(vd_max(under, least));
    const vd square = vd_add(vd_mul(vd_add(a, b), half), root);
    const vd scale = vd_select(vd_ge(square, least), vd_div(vd_set1(0.72134752044448170), square), zero);
    const vd in_root = vd_select(vd_ge(under, least), vd_div(half, root), zero), tilt = vd_mul(e, in_root);
    const vd by_a = vd_mul(vd_mul(scale, two), vd_add(half, tilt)),
             by_b = vd_mul(vd_mul(scale, two), vd_sub(half, tilt));
    const vd by_c = vd_mul(vd_mul(scale, two), vd_mul(c, in_root));
    for (int k = 0; k < 2; k++) {
        const vd *axis = k ? r : s, size = k ? h : w;
        by[2 * k] = vd_mul(size, vd_add(vd_mul(by_a, axis[0]), vd_mul(by_c, axis[1])));
        by[2 * k + 1] = vd_mul(size, vd_add(vd_mul(by_b, axis[1]), vd_mul(by_c, axis[0])));
    }
    return vd_mul(half, log2_of_lanes(vd_min(vd_max(square, least), vd_set1(0x1p120))));
}

/* Sets the levels of pixels. */
TL_INLINE void find_levels(const tl_grad_texture *t, const vd *slopes, const vd *bias, look_lanes *look)
{
    const vd zero = vd_set1(0.0);
    look->low = vi_set1(0), look->upper = zero;
    for (int k = 0; k < 4; k++)
        look->by[k] = zero;
    if (t->filter < TL_TEXEL_LEVEL)
        return;
    vd level = slopes ? footprint_level(t, slopes, look->by) : zero;
    if (bias)
        level = vd_add(level, *bias);
    look->is_there = vm_and(look->is_there, vd_ge(level, level));
    level = vd_min(vd_max(level, zero), vd_set1((double)(t->n_levels - 1)));
    look->low = vi_round(t->filter == TL_TEXEL_LEVEL ? level : vd_floor(level));
    if (t->filter == TL_TEXEL_LEVELS)
        look->upper = vd_sub(level, vd_floor(level));
}

/* The lookups of the n pixels from `pixel` on. */
TL_INLINE look_lanes look_at(const tl_grad_view *view, const tl_grad_texture *t, int64_t pixel, int n, int is_f64)
{
    look_lanes look = {.is_there = vm_first(n)};
    const size_t size = is_f64 ? sizeof(double) : sizeof(float);
    const int64_t n_rows = view->width * view->height - pixel;
    const int n_axes = t->edge == TL_EDGE_CUBE ? 3 : 2;
    const vi row = vi_min(vi_iota(), vi_set1(n - 1));
    vd place[4], by[8], slopes[4], bias[4];
    load_look_rows((const char *)t->uv + size * (size_t)(n_axes * pixel), n_rows, n_axes, 0, row, place, is_f64);
    for (int k = 0; t->uv_da && k < 2 * n_axes; k += 4)
        load_look_rows((const char *)t->uv_da + size * (size_t)(2 * n_axes * pixel), n_rows, 2 * n_axes, k, row, by + k,
                       is_f64);
    if (t->bias)
        load_look_rows((const char *)t->bias + size * (size_t)pixel, n_rows, 1, 0, row, bias, is_f64);
    if (n_axes == 3) {
        look.cube = meet_cube(place);
        look.is_there = vm_and(look.is_there, look.cube.is_there);
        memcpy(place, look.cube.uv, sizeof look.cube.uv);
        if (t->uv_da)
            slopes_on_face(&look.cube, by, slopes);
    }
    for (int k = 0; k < 2; k++) {
        look.is_kept[k] = vd_ge(vd_set1(DBL_MAX), vd_abs(place[k]));
        look.uv[k] = vd_select(look.is_kept[k], place[k], vd_set1(0.0));
    }
    find_levels(t, t->uv_da ? n_axes == 3 ? slopes : by : 0, t->bias ? bias : 0, &look);
    return look;
}

/* The levels [*first, *end) that any of the pixels reads. */
TL_INLINE void level_range(const tl_grad_texture *t, const look_lanes *look, int *first, int *end)
{
    int32_t low[TL_MAX_LANES];
    *first = 0, *end = 1;
    if (t->filter < TL_TEXEL_LEVEL)
        return;
    vi_spill(low, look->low);
    *first = *end = low[0];
    for (int k = 1; k < TL_LANES; k++)
        *first = low[k] < *first ? low[k] : *first, *end = low[k] > *end ? low[k] : *end;
    *end += 1 + (t->filter == TL_TEXEL_LEVELS && *end < t->n_levels - 1);
}

/* The pixels that read a level, and its share. */
TL_INLINE vm at_level(const look_lanes *look, int level, vd *share)
{
    const vm is_low = vi_eq(look->low, vi_set1(level)), is_upper = vi_eq(look->low, vi_set1(level - 1));
    const vm has_upper = vm_and_not(vm_all(), vd_ge(vd_set1(0.0), look->upper));
    *share = vd_select(is_low, vd_sub(vd_set1(1.0), look->upper), look->upper);
    return vm_and(look->is_there, vm_or(is_low, vm_and(is_upper, has_upper)));
}

/* Positions along an axis: the texel below, the distance from its centre, and the derivative of that distance by u. */
TL_INLINE vi along_axis(const tl_grad_texture *t, const look_lanes *look, int axis, int64_t size, vd *part, vd *by)
{
    const int is_nearest = t->filter == TL_TEXEL_NEAREST;
    const vd n = vd_set1((double)size), zero = vd_set1(0.0);
    const vd low = vd_set1(t->edge == TL_EDGE_CLAMP ? 0.0 : -2.0);
    const vd high = vd_add(n, vd_set1(t->edge == TL_EDGE_CLAMP ? -1.0 : 1.0));
    vd u = look->uv[axis];
    if (t->edge == TL_EDGE_WRAP)
        u = vd_sub(u, vd_floor(u));
    const vd at = vd_sub(vd_mul(u, n), vd_set1(is_nearest ? 0.0 : 0.5));
    const vd place = vd_min(vd_max(at, low), high), first = vd_floor(place);
    *part = vd_sub(place, first);
    *by = vd_select(vm_and(look->is_kept[axis], vm_and(vd_ge(at, low), vd_ge(high, at))), n, zero);
    const vi texel = vi_round(first);
    return is_nearest && t->edge == TL_EDGE_CUBE ? vi_min(texel, vi_set1((int32_t)size - 1)) : texel;
}

/* Beyond a corner of a cube there is no texel: the mean of the other three replaces it. */
TL_INLINE void share_corner(texel_shares *quad, int corner, vm is_there)
{
    const vd third = vd_set1(1.0 / 3.0), zero = vd_set1(0.0);
    vd *numbers[3] = {quad->share, quad->by[0], quad->by[1]};
    for (int i = 0; i < 3; i++) {
        const vd part = vd_select(is_there, zero, vd_mul(numbers[i][corner], third));
        for (int k = 0; k < 4; k++)
            numbers[i][k] = k == corner ? vd_select(is_there, numbers[i][k], zero) : vd_add(numbers[i][k], part);
    }
}

/* The row in the level of the texel in columns x and rows y; texels outside, with TL_EDGE_ZERO, get share k = 0. */
TL_INLINE vi place_texel(const tl_grad_texture *t, const look_lanes *look, int level, vi x, vi y, int k,
                         texel_shares *quad)
{
    const vi zero = vi_set1(0), width = vi_set1((int32_t)t->widths[level]),
             height = vi_set1((int32_t)t->heights[level]);
    const vm in_x = vi_gt_unsigned(width, x), in_y = vi_gt_unsigned(height, y), is_in = vm_and(in_x, in_y);
    const vi last_x = vi_sub(width, vi_set1(1)), last_y = vi_sub(height, vi_set1(1));
    vi face = t->edge == TL_EDGE_CUBE ? look->cube.face : zero;
    if (t->edge == TL_EDGE_WRAP) { /* x and y are outside by 1 at most */
        x = vi_select(in_x, x, vi_select(vi_gt(zero, x), last_x, zero));
        y = vi_select(in_y, y, vi_select(vi_gt(zero, y), last_y, zero));
    } else if (vm_any(vm_and_not(look->is_there, is_in))) {
        const vi given[2] = {x, y};
        x = vi_min(vi_max(x, zero), last_x), y = vi_min(vi_max(y, zero), last_y);
        if (t->edge == TL_EDGE_ZERO) {
            quad->share[k] = vd_select(is_in, quad->share[k], vd_set1(0.0));
            for (int axis = 0; axis < 2; axis++)
                quad->by[axis][k] = vd_select(is_in, quad->by[axis][k], vd_set1(0.0));
        } else if (t->edge == TL_EDGE_CUBE) {
            vi across[3] = {face, given[0], given[1]};
            const vm is_beside = vm_or(in_x, in_y);
            cross_edges(&look->cube, t->widths[level], &across[0], &across[1], &across[2]);
            const vm is_across = vm_and_not(is_beside, is_in);
            face = vi_select(is_across, across[0], face);
            x = vi_select(is_across, across[1], x), y = vi_select(is_across, across[2], y);
            share_corner(quad, k, is_beside);
        }
    }
    return vi_add(vi_mul(vi_add(vi_mul(face, height), y), width), x);
}

/* The four texels around points, or the nearest texel. */
TL_INLINE texel_shares find_shares(const tl_grad_texture *t, const look_lanes *look, int level)
{
    texel_shares quad = {.n = t->filter == TL_TEXEL_NEAREST ? 1 : 4};
    const vd one = vd_set1(1.0), zero = vd_set1(0.0);
    vd part[2], by[2];
    const vi x = along_axis(t, look, 0, t->widths[level], &part[0], &by[0]);
    const vi y = along_axis(t, look, 1, t->heights[level], &part[1], &by[1]);
    for (int k = 0; k < 4; k++) {
        const vd in_x = k & 1 ? part[0] : vd_sub(one, part[0]), in_y = k >> 1 ? part[1] : vd_sub(one, part[1]);
        quad.share[k] = quad.n == 1 ? k ? zero : one : vd_mul(in_x, in_y);
        quad.by[0][k] = quad.n == 1 ? zero : vd_mul(k & 1 ? by[0] : vd_sub(zero, by[0]), in_y);
        quad.by[1][k] = quad.n == 1 ? zero : vd_mul(k >> 1 ? by[1] : vd_sub(zero, by[1]), in_x);
    }
    for (int k = 0; k < quad.n; k++)
        quad.row[k] = place_texel(t, look, level, vi_add(x, vi_set1(k & 1)), vi_add(y, vi_set1(k >> 1)), k, &quad);
    return quad;
}

#endif
