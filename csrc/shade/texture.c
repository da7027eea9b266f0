/* Textures: samples a texture at (u, v), filtered.  Texels are linear light, so their mean is a mean of light.
 * In: coordinates and their derivatives by pixel.  Out: red, green, blue and opacity, 0 to 1.
 * Based on: L. Williams, Pyramidal Parametrics, 1983 (mipmaps); P. Heckbert, Fundamentals of Texture Mapping and Image
 * Warping, 1989 (the footprint of a pixel from derivatives). */
#ifndef TL_TEXTURE_C
#define TL_TEXTURE_C

#include <stdint.h>

#include "lanes/lanes.h"
#include "pixels/shading.h"

/* log2 of positive numbers, with a relative error of 2^-22, near 1 relative to the distance from 1; of 0: -127. */
TL_INLINE vf vf_log2(vf a)
{
    /* the exponent of a / sqrt(1/2), so that the rest is near 1 */
    const vi bits = vi_sub(vi_bits_of_vf(a), vi_set1(0x3f3504f3)), exponent = vi_shift_right(bits, 23);
    const vf rest = vf_of_bits(vi_add(vi_and(bits, vi_set1(0x007fffff)), vi_set1(0x3f3504f3)));
    const vf t = vf_sub(rest, vf_set1(1.0f));
    vf sum = vf_set1(0x1.08bada00p-3f);
    sum = vf_fma(sum, t, vf_set1(-0x1.abe51800p-3f));
    sum = vf_fma(sum, t, vf_set1(0x1.b8c15600p-3f));
    sum = vf_fma(sum, t, vf_set1(-0x1.e8cedc00p-3f));
    sum = vf_fma(sum, t, vf_set1(0x1.26d98000p-2f));
    sum = vf_fma(sum, t, vf_set1(-0x1.715f9a00p-2f));
    sum = vf_fma(sum, t, vf_set1(0x1.ec73be00p-2f));
    sum = vf_fma(sum, t, vf_set1(-0x1.71546c00p-1f));
    sum = vf_fma(sum, t, vf_set1(0x1.71547600p+0f));
    return vf_fma(sum, t, vf_from_vi(exponent));
}

/* The texel before a coordinate, and the share of the texel after it. */
typedef struct {
    vi first;
    vf share;
} texel_pair;

/* The fractional part, 0 to 1, for any finite number. */
TL_INLINE vf fraction_of(vf a)
{
    const vf rest = vf_sub(a, vf_from_vi(vi_floor(a)));
    return vf_min(vf_max(rest, vf_set1(0.0f)), vf_set1(1.0f)); /* limits it where `a` is too large to have a fraction */
}

TL_INLINE vf folded(vf a, tl_wrap wrap)
{
    const vf one = vf_set1(1.0f);
    if (wrap == TL_WRAP_REPEAT)
        return fraction_of(a);
    if (wrap == TL_WRAP_CLAMP)
        return vf_min(vf_max(a, vf_set1(0.0f)), one);
    const vf twice = vf_mul(vf_set1(2.0f), fraction_of(vf_mul(vf_set1(0.5f), a))), before = vf_sub(twice, one);
    return vf_sub(one, vf_max(before, vf_sub(vf_set1(0.0f), before)));
}

/* `a` is folded; `first` may be the last column: the texels of the first column follow it. */
TL_INLINE texel_pair find_pair(vf a, vi size, tl_wrap wrap)
{
    const vf length = vf_from_vi(size);
    vf x = vf_fma(a, length, vf_set1(-0.5f));
    if (wrap != TL_WRAP_REPEAT)
        x = vf_min(vf_max(x, vf_set1(0.0f)), vf_sub(length, vf_set1(1.0f)));
    const vi below = vi_floor(x);
    texel_pair pair = {below, vf_sub(x, vf_from_vi(below))};
    if (wrap == TL_WRAP_REPEAT)
        pair.first = vi_select(vi_gt(vi_set1(0), below), vi_add(below, size), below);
    return pair;
}

TL_INLINE vi find_nearest(vf a, vi size)
{
    return vi_min(vi_floor(vf_mul(a, vf_from_vi(size))), vi_sub(size, vi_set1(1)));
}

TL_INLINE vf low_channel(vi texels) { return vf_from_vi(vi_low_half(texels)); }
TL_INLINE vf high_channel(vi texels) { return vf_from_vi(vi_high_half(texels)); }

TL_INLINE void sample_nearest(const tl_texture *t, vf u, vf v, vf *rgba)
{
    const vi width = vi_set1(t->width[0]), x = find_nearest(u, width), y = find_nearest(v, vi_set1(t->height[0]));
    _Alignas(64) int32_t at[TL_MAX_LANES];
    vf pair[2];
    vi_spill(at, vi_add(vi_mul(y, vi_add(width, vi_set1(1))), x));
    vf_load_pairs(t->texels, at, pair);
    const vi rg = vi_bits_of_vf(pair[0]), ba = vi_bits_of_vf(pair[1]);
    rgba[0] = low_channel(rg), rgba[1] = high_channel(rg), rgba[2] = low_channel(ba), rgba[3] = high_channel(ba);
}

/* The four texels around (u, v) on a level per lane, and their weights. */
typedef struct {
    _Alignas(64) int32_t at[2][TL_MAX_LANES]; /* of the upper two and of the lower two texels */
    vf weight[4];
} texel_quad;

/* In `sharp` lanes the nearest texel has all the weight. */
TL_INLINE void find_quad(const tl_texture *t, vi level, vf u, vf v, vm sharp, texel_quad *quad)
{
    const vi width = vi_lookup(t->width, level), height = vi_lookup(t->height, level), one = vi_set1(1);
    texel_pair x = find_pair(u, width, t->wrap_u), y = find_pair(v, height, t->wrap_v);
    if (t->filter == TL_FILTER_PIXELATED) {
        x.share = vf_select(sharp, vf_from_vi(vi_floor(vf_add(x.share, vf_set1(0.5f)))), x.share);
        y.share = vf_select(sharp, vf_from_vi(vi_floor(vf_add(y.share, vf_set1(0.5f)))), y.share);
    }
    const vi next = vi_add(y.first, one), stride = vi_add(width, one);
    const vi second = vi_select(vi_gt(height, next), next, t->wrap_v == TL_WRAP_REPEAT ? vi_set1(0) : y.first);
    const vi base = vi_add(vi_lookup(t->offset, level), x.first);
    vi_spill(quad->at[0], vi_add(base, vi_mul(y.first, stride)));
    vi_spill(quad->at[1], vi_add(base, vi_mul(second, stride)));
    quad->weight[3] = vf_mul(x.share, y.share);
    quad->weight[1] = vf_sub(x.share, quad->weight[3]), quad->weight[2] = vf_sub(y.share, quad->weight[3]);
    quad->weight[0] = vf_sub(vf_sub(vf_set1(1.0f), x.share), quad->weight[2]);
}

/* The weighted sum of the four texels, in 65535ths. */
TL_INLINE void filter_quad(const tl_texture *t, const texel_quad *quad, vf *rgba, int n_channels)
{
    vi row[2][4];
    for (int k = 0; k < 2; k++)
        vi_load_records(t->texels, 8, quad->at[k], row[k]);
    for (int c = 0; c < n_channels; c++) {
        vf texel[4];
        for (int k = 0; k < 4; k++) {
            const vi words = row[k >> 1][2 * (k & 1) + (c >> 1)];
            texel[k] = c & 1 ? high_channel(words) : low_channel(words);
        }
        const vf upper = vf_fma(quad->weight[1], texel[1], vf_mul(quad->weight[0], texel[0]));
        rgba[c] = vf_fma(quad->weight[3], texel[3], vf_fma(quad->weight[2], texel[2], upper));
    }
}

/* The mipmap level at which texels are as large as a pixel: log2 of the longer side of its footprint. */
TL_INLINE vf level_of_detail(const tl_texture *t, const vf *du, const vf *dv)
{
    const vf width = vf_set1((float)t->width[0]), height = vf_set1((float)t->height[0]);
    vf squared[2];
    for (int axis = 0; axis < 2; axis++) {
        const vf x = vf_mul(du[axis], width), y = vf_mul(dv[axis], height);
        squared[axis] = vf_fma(x, x, vf_mul(y, y));
    }
    return vf_mul(vf_set1(0.5f), vf_log2(vf_max(squared[0], squared[1])));
}

/* The texels that each lane reads; textures of one size that are laid alike share them. */
typedef struct {
    const tl_texture *as; /* NULL: not set */
    texel_quad fine, coarse;
    vf share; /* of the coarser level */
    int has_coarse;
} laid_texture;

/* Whether two textures read the texels at equal positions: by one set of uv, without a transform. */
TL_INLINE int is_laid_alike(const tl_texture *a, const tl_texture *b)
{
    return a == b || (a->width[0] == b->width[0] && a->height[0] == b->height[0] && a->n_levels == b->n_levels &&
                      a->filter == b->filter && a->wrap_u == b->wrap_u && a->wrap_v == b->wrap_v &&
                      a->uv_set == b->uv_set && !a->has_transform && !b->has_transform);
}

/* Sets the texels to read; not for textures with TL_FILTER_NEAREST. */
TL_INLINE void find_texels(const tl_texture *t, vf u, vf v, const vf *du, const vf *dv, laid_texture *laid)
{
    u = folded(u, t->wrap_u), v = folded(v, t->wrap_v);
    laid->as = t, laid->has_coarse = 0;
    if (t->filter == TL_FILTER_BILINEAR) {
        find_quad(t, vi_set1(0), u, v, vm_first(0), &laid->fine);
        return;
    }
    const vf zero = vf_set1(0.0f), last = vf_set1((float)(t->n_levels - 1));
    const vf detail = level_of_detail(t, du, dv), lod = vf_min(vf_max(detail, zero), last);
    const vi level = vi_floor(lod);
    const vm sharp = t->filter == TL_FILTER_PIXELATED ? vf_ge(zero, detail) : vm_first(0);
    laid->share = vf_sub(lod, vf_from_vi(level));
    laid->has_coarse = vm_any(vf_lt(zero, laid->share));
    find_quad(t, level, u, v, sharp, &laid->fine);
    if (laid->has_coarse)
        find_quad(t, vi_min(vi_add(level, vi_set1(1)), vi_set1(t->n_levels - 1)), u, v, sharp, &laid->coarse);
}

TL_INLINE void filter_texels(const tl_texture *t, const laid_texture *laid, vf *rgba, int n_channels)
{
    filter_quad(t, &laid->fine, rgba, n_channels);
    if (laid->has_coarse) {
        vf coarser[4];
        filter_quad(t, &laid->coarse, coarser, n_channels);
        for (int c = 0; c < n_channels; c++)
            rgba[c] = vf_fma(laid->share, vf_sub(coarser[c], rgba[c]), rgba[c]);
    }
}

/* Samples the texture at (u, v); du, dv: derivatives by column and by row. */
TL_INLINE void sample_laid(const tl_texture *t, vf u, vf v, const vf *du, const vf *dv, laid_texture *laid, vf *rgba,
                           int n_channels)
{
    if (t->filter == TL_FILTER_NEAREST) {
        sample_nearest(t, folded(u, t->wrap_u), folded(v, t->wrap_v), rgba);
    } else {
        if (!laid->as || !is_laid_alike(t, laid->as))
            find_texels(t, u, v, du, dv, laid);
        filter_texels(t, laid, rgba, n_channels);
    }
    for (int c = 0; c < n_channels; c++)
        rgba[c] = vf_mul(rgba[c], vf_set1(1.0f / 65535.0f));
}

/* Samples a texture without a layout to share. */
TL_INLINE void sample_texture(const tl_texture *t, vf u, vf v, const vf *du, const vf *dv, vf *rgba, int n_channels)
{
    laid_texture laid;
    laid.as = (const tl_texture *)0;
    sample_laid(t, u, v, du, dv, &laid, rgba, n_channels);
}

#endif
