/* From light to the sRGB values of a picture; and grey light: a surface of one colour under white lights, where all
 * channels are that colour times one light.
 * In: linear light, or the pixels of runs.  Out: whole numbers of 0 to 255.
 *
 * Light is rounded to steps of 2^-16, and a step to the nearest sRGB value of 0 to 255: the polynomial below gives that
 * value for each of the 65537 steps (the tests of shading check all of them).
 *
 * The curve of sRGB is a power: the power of a product is the product of the powers.  So grey light needs one root for
 * three channels, of the unrounded light, where `encode_srgb` takes a root of each channel's light, rounded to a step.
 * Based on: IEC 61966-2-1, 1999. */
#ifndef TL_SRGB_C
#define TL_SRGB_C

#include "lanes/lanes.h"
#include "pixels/runs.c"
#include "pixels/shading.h"
#include "shade/light.c"
#include "shade/shade_pixels.c"

#define TL_LIGHT_STEPS 65536.0f
#define SRGB_SLOPE (12.92f * 255.0f) /* of the linear part, for dark light */
#define SRGB_LINE_END 205.5f         /* in steps */
#define SRGB_OFFSET (0.055f * 255.0f)

/* 255 * 1.055 * (2^(i - 127) / 2^16)^(1 / 2.4) for a biased exponent i, at i & 15: 1 to 2^15 steps of light. */
static const float SRGB_SCALE[16] = {
    0x1.c471be00p+1f, 0x1.2df86a00p+2f, 0x1.93150200p+2f, 0x1.0d066600p+3f, 0x1.671af400p+3f, 0x1.df591a00p+3f,
    0x1.3fed2c00p+4f, 0x1.ab0cf200p+4f, 0x1.1d05a600p+5f, 0x1.7c757400p+5f, 0x1.fbda0000p+5f, 0x1.52f34400p+6f,
    0x1.c471be00p+6f, 0x1.2df86a00p+7f, 0x1.93150200p+7f, 0x1.52f34400p+1f,
};

/* The two factors of 255 * 1.055 * (a / 2^16)^(1 / 2.4) for 1 <= a < 2^16; undefined elsewhere. */
TL_INLINE vf srgb_root(vf a, vf *scale)
{
    const vi bits = vi_bits_of_vf(a);
    const vf m = vf_of_bits(vi_or(vi_and(bits, vi_set1(0x007fffff)), vi_set1(0x3f800000)));
    *scale = vf_lookup(SRGB_SCALE, vi_shift_right(bits, 23));
    vf root = vf_set1(-0x1.762b04p-9f); /* m^(5/12), 1 <= m < 2 */
    root = vf_fma(root, m, vf_set1(0x1.fab834p-6f));
    root = vf_fma(root, m, vf_set1(-0x1.295ce8p-3f));
    root = vf_fma(root, m, vf_set1(0x1.8fcab0p-2f));
    root = vf_fma(root, m, vf_set1(-0x1.601ed2p-1f));
    root = vf_fma(root, m, vf_set1(0x1.106ad8p+0f));
    return vf_fma(root, m, vf_set1(0x1.66b6eap-2f));
}

/* Light of 0 to 1 to whole sRGB values. */
TL_INLINE vi encode_srgb(vf light)
{
    const vf steps = vf_mul(vf_max(light, vf_set1(0.0f)), vf_set1(TL_LIGHT_STEPS));
    const vf whole = vf_from_vi(vi_nearest(vf_min(steps, vf_set1(TL_LIGHT_STEPS - 1.0f))));
    vf scale;
    const vf root = srgb_root(whole, &scale);
    const vf curve = vf_fma(root, scale, vf_set1(-SRGB_OFFSET));
    const vf line = vf_mul(whole, vf_set1(SRGB_SLOPE / TL_LIGHT_STEPS));
    return vi_nearest(vf_select(vf_lt(whole, vf_set1(SRGB_LINE_END)), line, curve));
}

/* Rounds values of 0 to 255, or encodes light. */
TL_INLINE vi to_byte(tl_show show, vf a)
{
    if (show != TL_SHOW_NORMALS)
        return encode_srgb(a);
    return vi_max(vi_min(vi_nearest(a), vi_set1(255)), vi_set1(0));
}

TL_INLINE vi to_word(vi r, vi g, vi b, vi a)
{
    return vi_or(vi_or(r, vi_shift_left(g, 8)), vi_or(vi_shift_left(b, 16), vi_shift_left(a, 24)));
}

/* The largest light whose root is taken, in steps of 2^-10. */
#define TL_MOST_GREY 63.0f
#define TL_GREY_STEPS 1024.0f

/* 2^(35 / 12) / (255 * 1.055): corrects the product of two results of srgb_root, for a colour in steps of 2^-15 and
 * light in steps of 2^-10 instead of 2^-16, and with the factor 255 * 1.055 only once. */
#define TL_GREY_SCALE 0x1.cbddbcp-6f

static int is_white(const float *color) { return color[0] == color[1] && color[1] == color[2]; }

/* Sets whether the surface has one colour and white light up to TL_MOST_GREY; if so, the roots of the colour. */
static void start_grey(shade_runs *s)
{
    const tl_shading *shading = s->shading;
    const tl_material *m = shading->materials;
    float most = shading->ambient[0];
    s->is_grey = is_white(shading->ambient) && shading->show == TL_SHOW_LIGHT && !shading->material_of &&
                 shading->n_materials > 0 && !m->is_unlit && !m->is_full && !m->texture && m->back_side == 0.0f &&
                 !(m->shininess > 0.0f) && !s->needs_q;
    for (int k = 0; k < shading->n_lights; k++) {
        s->is_grey &= is_white(shading->lights[k].color);
        most += shading->lights[k].color[0];
    }
    s->is_grey &= most <= TL_MOST_GREY;
    for (int c = 0; s->is_grey && c < 3; c++) {
        const vf steps = vf_min(vf_max(vf_set1(m->color[c]), vf_set1(0.0f)), vf_set1(1.0f));
        float root[TL_MAX_LANES];
        vf scale;
        const vf own = srgb_root(vf_mul(steps, vf_set1(0.5f * TL_LIGHT_STEPS)), &scale);
        vf_store(root, vf_mul(vf_mul(own, scale), vf_set1(TL_GREY_SCALE)));
        s->grey_root[c] = root[0];
        s->grey_line[c] = m->color[c] * (SRGB_SLOPE / TL_GREY_STEPS);
    }
}

/* The light of pixels with normals, in steps. */
TL_INLINE vf grey_light(const shaded_lanes *p)
{
    lit_surface surface;
    vf diffuse[3], specular[3];
    for (int axis = 0; axis < 3; axis++)
        /* no highlights */
        surface.normal[axis] = p->normal[axis], surface.point[axis] = surface.to_eye[axis] = vf_set1(0.0f);
    add_lights(&surface, p->s->shading, 0.0f, diffuse, specular);
    return vf_mul(diffuse[0], vf_set1(TL_GREY_STEPS));
}

/* The light of vector i of the span that begins at `column`, for all runs and normals. */
static void light_any_grey(const shade_runs *s, int i, int64_t column, float *steps)
{
    shaded_lanes p;
    find_pixels(&p, s, i, column);
    set_normals(&p);
    vf_store(steps, grey_light(&p));
}

/* The light of vector i of the span that begins at `column`.  Rare cases start anew in a call: if the lanes were passed
 * to a call, every vector would store them. */
TL_INLINE void light_grey(const shade_runs *s, int i, int64_t column, float *steps)
{
    shaded_lanes p;
    find_most_pixels(&p, s, i, column);
    if (s->n_special || vm_any(find_normals(&p)))
        light_any_grey(s, i, column, steps);
    else
        vf_store(steps, grey_light(&p));
}

/* The words of pixels in grey light: one root for three channels. */
TL_INLINE vi grey_word(const shade_runs *s, vf steps)
{
    const vf last = vf_set1(255.0f), line_end = vf_set1(SRGB_LINE_END * SRGB_SLOPE / TL_LIGHT_STEPS);
    vf scale;
    vi byte[3];
    const vf root = srgb_root(steps, &scale), curve = vf_mul(root, scale);
    for (int c = 0; c < 3; c++) {
        const vf line = vf_mul(steps, vf_set1(s->grey_line[c]));
        const vf bent = vf_fma(curve, vf_set1(s->grey_root[c]), vf_set1(-SRGB_OFFSET));
        byte[c] = vi_nearest(vf_min(vf_select(vf_lt(line, line_end), line, bent), last));
    }
    return to_word(byte[0], byte[1], byte[2], vi_set1(255));
}

#endif
