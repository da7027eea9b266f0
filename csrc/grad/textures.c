/* Textures at pixels: the nearest texel, four texels, or four of each of two mipmap levels; and backward.
 * In: levels, coordinates, footprints.  Out: pictures; backward: gradients of coordinates, footprints and biases, sums
 * by texel.
 *
 * Pixels are in lanes; gradients are added to texels pixel by pixel, so that each sum has the order of pixels. */
#ifndef TL_GRAD_TEXTURES_C
#define TL_GRAD_TEXTURES_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "grad/grad.h"
#include "grad/looks.c"
#include "grad/pixels.h"
#include "grad/spans.h"
#include "lanes/lanes.h"
#include "lanes/quads.h"

/* The first number of a pixel of a tensor with n numbers each; NULL for NULL. */
TL_INLINE void *at_pixel(const void *p, int64_t n, int64_t pixel, int is_f64)
{
    return p ? (char *)p + (is_f64 ? 8 : 4) * n * pixel : 0;
}

/* Loads channels [first, first + 4) of texels of a level. */
TL_INLINE void load_texels(const tl_grad_texture *t, int level, vi row, int64_t first, vd *channels, int is_f64)
{
    const int64_t n_faces = t->edge == TL_EDGE_CUBE ? 6 : 1;
    load_look_rows(t->levels[level], n_faces * t->widths[level] * t->heights[level], t->n_channels, first, row,
                   channels, is_f64);
}

/* Samples four channels of the texture from `first` on. */
TL_INLINE void mix_texels(const tl_grad_texture *t, const look_lanes *look, int64_t first, vd *sum, int is_f64)
{
    int level, end;
    level_range(t, look, &level, &end);
    for (int c = 0; c < 4; c++)
        sum[c] = vd_set1(0.0);
    for (; level < end; level++) {
        vd share, found[4] = {sum[0], sum[0], sum[0], sum[0]}, texel[4];
        const vm m = at_level(look, level, &share);
        if (!vm_any(m))
            continue;
        const texel_shares quad = find_shares(t, look, level);
        for (int c = 0; c < 4; c++)
            found[c] = vd_set1(0.0);
        for (int k = 0; k < quad.n; k++) {
            load_texels(t, level, vi_select(m, quad.row[k], vi_set1(0)), first, texel, is_f64);
            for (int c = 0; c < 4; c++)
                found[c] = vd_add(found[c], vd_mul(quad.share[k], texel[c]));
        }
        for (int c = 0; c < 4; c++)
            sum[c] = vd_select(m, vd_add(sum[c], vd_mul(share, found[c])), sum[c]);
    }
}

TL_INLINE void texels_of(const tl_grad_view *view, const tl_grad_texture *t, int is_f64)
{
    const int64_t end = view->end_row * view->width;
    for (int64_t pixel = view->first_row * view->width; pixel < end; pixel += TL_LANES) {
        const int n = end - pixel < TL_LANES ? (int)(end - pixel) : TL_LANES;
        const look_lanes look = look_at(view, t, pixel, n, is_f64);
        void *out = at_pixel(t->out, t->n_channels, pixel, is_f64);
        for (int64_t first = 0; first < t->n_channels; first += 4) {
            const int64_t rest = t->n_channels - first;
            vd sum[4];
            mix_texels(t, &look, first, sum, is_f64);
            store_look_rows(out, t->n_channels, first, rest < 4 ? (int)rest : 4, vm_first(n), sum, is_f64);
        }
    }
}

/* See kernels.h. */
static void grad_texels(const tl_grad_view *view, const tl_grad_texture *texture)
{
    if (view->is_f64)
        texels_of(view, texture, 1);
    else
        texels_of(view, texture, 0);
}

/* Pixels of a backward pass: the rows of g, lanes in m. */
typedef struct {
    const tl_grad_texture *t;
    const void *g; /* gradients, from the first pixel on */
    int64_t n_left;
    vi row;
    vm m;
} backward_lanes;

/* Adds `share` times the gradients of pixels to their texels of a level. */
TL_INLINE void scatter_shares(const backward_lanes *p, const texel_shares *quad, int level, vm m, vd share,
                              tl_grad_sums *sums, int is_f64)
{
    const int64_t n = p->t->n_channels;
    int32_t rows[4][TL_MAX_LANES];
    double shares[4][TL_MAX_LANES];
    for (int k = 0; k < quad->n; k++)
        vi_spill(rows[k], quad->row[k]), vd_store(shares[k], vd_mul(share, quad->share[k]));
    for (unsigned bits = vm_bits(m); bits; bits &= bits - 1) {
        const int lane = __builtin_ctz(bits);
        for (int64_t c = 0; c < n; c += 4) {
            const int64_t at = n * lane + c;
            const int is_last = at + 4 > n * p->n_left, n_some = n - c < 4 ? (int)(n - c) : 4;
            double some[4] = {0};
            for (int i = 0; is_f64 && i < n_some; i++)
                some[i] = ((const double *)p->g)[at + i];
            const vqd g = is_f64    ? vqd_load(some)
                          : is_last ? vqd_from_vq(vq_load_some((const float *)p->g + at, n_some))
                                    : vqd_from_vq(vq_load((const float *)p->g + at));
            for (int k = 0; k < quad->n; k++) {
                if (shares[k][lane] == 0.0)
                    continue;
                double *to = sums_of(sums, p->t->first_texels[level] + rows[k][lane]) + c;
                vqd_store(to, vqd_add(vqd_load(to), vqd_mul(vqd_set1(shares[k][lane]), g)));
            }
        }
    }
}

/* Adds the gradients of u and v by a level; sets *total, the derivative by the level's share. */
TL_INLINE void backward_shares(const backward_lanes *p, const texel_shares *quad, int level, vm m, vd share, vd *g_uv,
                               vd *total, int is_f64)
{
    vd value[4], g[4], texel[4];
    for (int k = 0; k < 4; k++)
        value[k] = vd_set1(0.0);
    for (int64_t first = 0; first < p->t->n_channels; first += 4) {
        load_look_rows(p->g, p->n_left, p->t->n_channels, first, p->row, g, is_f64);
        for (int k = 0; k < quad->n; k++) {
            load_texels(p->t, level, vi_select(m, quad->row[k], vi_set1(0)), first, texel, is_f64);
            for (int64_t c = 0; c < 4 && c < p->t->n_channels - first; c++)
                value[k] = vd_add(value[k], vd_mul(g[c], texel[c]));
        }
    }
    vd sums[3] = {vd_set1(0.0), vd_set1(0.0), vd_set1(0.0)};
    for (int k = 0; k < quad->n; k++) {
        sums[0] = vd_add(sums[0], vd_mul(quad->share[k], value[k]));
        for (int axis = 0; axis < 2; axis++)
            sums[1 + axis] = vd_add(sums[1 + axis], vd_mul(quad->by[axis][k], value[k]));
    }
    *total = sums[0];
    for (int axis = 0; axis < 2; axis++)
        g_uv[axis] = vd_select(m, vd_add(g_uv[axis], vd_mul(share, sums[1 + axis])), g_uv[axis]);
}

/* Writes the gradients of coordinates, footprints and biases, from the gradients of u, v and the level. */
TL_INLINE void store_looks(const tl_grad_texture *t, const look_lanes *look, int64_t pixel, vm m, const vd *g_uv,
                           vd g_level, int is_f64)
{
    const int n_axes = t->edge == TL_EDGE_CUBE ? 3 : 2;
    const vd zero = vd_set1(0.0);
    vd g_slopes[6] = {zero, zero, zero, zero, zero, zero}, g_place[3] = {g_uv[0], g_uv[1], zero}, by[6];
    for (int k = 0; k < 4; k++)
        g_slopes[k] = vd_mul(g_level, look->by[k]);
    if (n_axes == 3) {
        backward_cube(&look->cube, g_uv, g_slopes, g_place, by, t->uv_da != 0);
        for (int k = 0; k < 3; k++)
            g_place[k] = vd_select(look->is_there, g_place[k], zero);
        for (int k = 0; t->uv_da && k < 6; k++)
            g_slopes[k] = vd_select(look->is_there, by[k], zero);
    }
    store_look_rows(at_pixel(t->g_uv, n_axes, pixel, is_f64), n_axes, 0, n_axes, m, g_place, is_f64);
    if (t->g_uv_da)
        store_look_rows(at_pixel(t->g_uv_da, 2 * n_axes, pixel, is_f64), 2 * n_axes, 0, 2 * n_axes, m, g_slopes,
                        is_f64);
    if (t->g_bias)
        store_look_rows(at_pixel(t->g_bias, 1, pixel, is_f64), 1, 0, 1, m, &g_level, is_f64);
}

/* The pixels with a gradient in some channel. */
TL_INLINE vm find_backward(const backward_lanes *p, int is_f64)
{
    const vd zero = vd_set1(0.0);
    vm is_zero = vm_all();
    vd g[4];
    for (int64_t first = 0; first < p->t->n_channels; first += 4) {
        load_look_rows(p->g, p->n_left, p->t->n_channels, first, p->row, g, is_f64);
        for (int64_t c = 0; c < 4 && c < p->t->n_channels - first; c++)
            is_zero = vm_and(is_zero, vm_and(vd_ge(g[c], zero), vd_ge(zero, g[c])));
    }
    return vm_and_not(p->m, is_zero);
}

TL_INLINE void backward_texels(const tl_grad_view *view, const tl_grad_texture *t, tl_grad_sums *sums, int is_f64)
{
    const int64_t end_pixel = view->end_row * view->width;
    const int n_axes = t->edge == TL_EDGE_CUBE ? 3 : 2;
    clear_band(view, t->g_uv, n_axes);
    clear_band(view, t->g_uv_da, 2 * n_axes);
    clear_band(view, t->g_bias, 1);
    for (int64_t pixel = view->first_row * view->width; pixel < end_pixel; pixel += TL_LANES) {
        const int n = end_pixel - pixel < TL_LANES ? (int)(end_pixel - pixel) : TL_LANES;
        backward_lanes p = {t, at_pixel(t->out, t->n_channels, pixel, is_f64), view->width * view->height - pixel,
                            vi_min(vi_iota(), vi_set1(n - 1)), vm_first(n)};
        p.m = find_backward(&p, is_f64);
        if (!vm_any(p.m))
            continue;
        vd share, g_uv[2] = {vd_set1(0.0), vd_set1(0.0)}, g_level = vd_set1(0.0), total;
        const look_lanes look = look_at(view, t, pixel, n, is_f64);
        int level, end;
        level_range(t, &look, &level, &end);
        for (; level < end; level++) {
            const vm m = vm_and(p.m, at_level(&look, level, &share));
            if (!vm_any(m))
                continue;
            const texel_shares quad = find_shares(t, &look, level);
            if (sums)
                scatter_shares(&p, &quad, level, m, share, sums, is_f64);
            if (!t->g_uv)
                continue;
            backward_shares(&p, &quad, level, m, share, g_uv, &total, is_f64);
            const vm is_low = vi_eq(look.low, vi_set1(level)),
                     has_upper = vm_and_not(m, vd_ge(vd_set1(0.0), look.upper));
            const vd change = vd_select(is_low, vd_sub(vd_set1(0.0), total), total);
            g_level = vd_select(has_upper, vd_add(g_level, change), g_level);
        }
        if (t->g_uv)
            store_looks(t, &look, pixel, p.m, g_uv, g_level, is_f64);
    }
    if (sums)
        flush_band(sums);
}

/* See kernels.h. */
static void grad_texels_vjp(const tl_grad_view *view, const tl_grad_texture *texture, tl_grad_sums *sums)
{
    if (view->is_f64)
        backward_texels(view, texture, sums, 1);
    else
        backward_texels(view, texture, sums, 0);
}

#endif
