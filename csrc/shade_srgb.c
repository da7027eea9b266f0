/* sRGB: from light to the values of a picture.
 * In: linear light.  Out: whole numbers of 0 to 255.
 *
 * Light is rounded to steps of 2^-16, and a step to the nearest sRGB value of 0 to 255: the polynomial below gives that value
 * for each of the 65537 steps (tests/shade/test_shade.py looks at all of them).
 * Based on: IEC 61966-2-1, 1999. */
#include "lanes.h"
#include "shading.h"

#define TL_LIGHT_STEPS 65536.0f
#define SRGB_SLOPE (12.92f * 255.0f) /* of the line that dark light follows */
#define SRGB_LINE_END 205.5f         /* in steps */
#define SRGB_OFFSET (0.055f * 255.0f)

/* 255 * 1.055 * (2^(i - 127) / 2^16)^(1 / 2.4) for a biased exponent i, at i & 15: 1 to 2^15 steps of light. */
static const float SRGB_SCALE[16] = {
    0x1.c471be00p+1f, 0x1.2df86a00p+2f, 0x1.93150200p+2f, 0x1.0d066600p+3f,
    0x1.671af400p+3f, 0x1.df591a00p+3f, 0x1.3fed2c00p+4f, 0x1.ab0cf200p+4f,
    0x1.1d05a600p+5f, 0x1.7c757400p+5f, 0x1.fbda0000p+5f, 0x1.52f34400p+6f,
    0x1.c471be00p+6f, 0x1.2df86a00p+7f, 0x1.93150200p+7f, 0x1.52f34400p+1f,
};

/* The two factors of 255 * 1.055 * (a / 2^16)^(1 / 2.4) for 1 <= a < 2^16; some number elsewhere. */
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

/* Light of 0 to 1 as whole sRGB values. */
TL_INLINE vi encode_srgb(vf light)
{
    const vf steps = vf_mul(vf_max(light, vf_set1(0.0f)), vf_set1(TL_LIGHT_STEPS));
    const vf whole = vf_from_vi(vi_rint(vf_min(steps, vf_set1(TL_LIGHT_STEPS - 1.0f))));
    vf scale;
    const vf root = srgb_root(whole, &scale);
    const vf curve = vf_fma(root, scale, vf_set1(-SRGB_OFFSET)), line = vf_mul(whole, vf_set1(SRGB_SLOPE / TL_LIGHT_STEPS));
    return vi_rint(vf_select(vf_lt(whole, vf_set1(SRGB_LINE_END)), line, curve));
}

/* Values of 0 to 255 as they are, light encoded. */
TL_INLINE vi to_byte(tl_show show, vf a)
{
    if (show != TL_SHOW_NORMALS)
        return encode_srgb(a);
    return vi_max(vi_min(vi_rint(a), vi_set1(255)), vi_set1(0));
}

TL_INLINE vi to_word(vi r, vi g, vi b, vi a)
{
    return vi_or(vi_or(r, vi_shift_left(g, 8)), vi_or(vi_shift_left(b, 16), vi_shift_left(a, 24)));
}
