/* Shade: a visibility buffer to a picture, in light, and from light to sRGB.
 * In: ids, the scene they were drawn from, materials and lights.  Out: red, green, blue and opacity, uint8.
 *
 * Light is rounded to steps of 2^-16, and a step to the nearest sRGB value of 0 to 255: the polynomial below gives that value
 * for each of the 65537 steps (tests/test_shade.py looks at all of them). */
#include "fixed.h"
#include "lanes.h"

#define TL_LIGHT_STEPS 65536.0f

/* 255 * 1.055 * (2^(i - 7) / 2^7)^(1 / 2.4) for the bits i of a biased exponent, at i & 15: 2^7 to 2^15 steps of light. */
static const float SRGB_SCALE[16] = {
    0x1.c471be00p+1f, 0x1.2df86a00p+2f, 0x1.93150200p+2f, 0x1.0d066600p+3f,
    0x1.671af400p+3f, 0x1.df591a00p+3f, 0x1.3fed2c00p+4f, 0x1.ab0cf200p+4f,
    0x1.1d05a600p+5f, 0x1.7c757400p+5f, 0x1.fbda0000p+5f, 0x1.52f34400p+6f,
    0x1.c471be00p+6f, 0x1.2df86a00p+7f, 0x1.93150200p+7f, 0x1.52f34400p+1f,
};

/* Light of 0 to 1 as whole sRGB values. */
TL_INLINE vi encode_srgb(vf light)
{
    const vf steps = vf_mul(vf_max(light, vf_set1(0.0f)), vf_set1(TL_LIGHT_STEPS));
    const vf whole = vf_from_vi(vi_rint(vf_min(steps, vf_set1(TL_LIGHT_STEPS - 1.0f))));
    const vi bits = vi_bits_of_vf(whole);
    const vf scale = vf_lookup(SRGB_SCALE, vi_and(vi_shift_right(bits, 23), vi_set1(15)));
    const vf m = vf_of_bits(vi_or(vi_and(bits, vi_set1(0x007fffff)), vi_set1(0x3f800000)));
    vf root = vf_set1(-0x1.762b04p-9f); /* m^(5/12), 1 <= m < 2 */
    root = vf_fma(root, m, vf_set1(0x1.fab834p-6f));
    root = vf_fma(root, m, vf_set1(-0x1.295ce8p-3f));
    root = vf_fma(root, m, vf_set1(0x1.8fcab0p-2f));
    root = vf_fma(root, m, vf_set1(-0x1.601ed2p-1f));
    root = vf_fma(root, m, vf_set1(0x1.106ad8p+0f));
    root = vf_fma(root, m, vf_set1(0x1.66b6eap-2f));
    const vf curve = vf_fma(root, scale, vf_set1(-0.055f * 255.0f)), line = vf_mul(whole, vf_set1(12.92f * 255.0f / TL_LIGHT_STEPS));
    return vi_rint(vf_select(vf_lt(whole, vf_set1(205.5f)), line, curve));
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

static void start_runs(shade_runs *s, const tl_scene *scene, const tl_window *window, const tl_view *view, const tl_shading *shading)
{
    int shines = 0, has_texture = 0, is_lit = 0, has_points = 0;
    for (int k = 0; k < shading->n_materials; k++) {
        const tl_material *m = &shading->materials[k];
        has_texture |= m->texture != NULL;
        is_lit |= !m->is_unlit;
        shines |= !m->is_unlit && m->shininess > 0.0f;
    }
    for (int k = 0; k < shading->n_lights; k++)
        has_points |= shading->lights[k].kind == TL_LIGHT_POINT;
    const int shows_light = shading->show == TL_SHOW_LIGHT;
    s->scene = scene, s->window = window, s->shading = shading, s->view = view;
    s->needs_normal = !shows_light || is_lit;
    s->needs_uv = shows_light && has_texture && shading->uv;
    s->needs_colors = shows_light && shading->colors;
    s->needs_point = shows_light && ((is_lit && has_points) || shines);
    s->needs_q = s->needs_uv || s->needs_colors || s->needs_point || shading->fog_scale != 0.0f;
    memset(s->ints, 0, sizeof s->ints);
    for (int k = 0; k < N_RUN_FLOATS; k++)
        memset(s->floats[k], 0, TL_MAX_LANES * sizeof(float));
}

/* The picture of a visibility buffer; rows of window->width. */
static void shade(const tl_scene *scene, const tl_window *window, const tl_view *view, const tl_shading *shading, const int32_t *ids,
                  const float *depth, uint8_t *pixels)
{
    shade_runs s;
    int32_t background;
    memcpy(&background, shading->background_bytes, 4);
    start_runs(&s, scene, window, view, shading);
    for (int64_t row = 0; row < window->height; row++)
        for (int64_t column = 0; column < window->width; column += TL_SPAN) {
            const int64_t at = row * window->width + column;
            const int n = (int)min64(TL_SPAN, window->width - column);
            find_runs(&s, ids + at, n);
            set_runs(&s, row);
            for (int x = 0, i = 0; x < n; x += TL_LANES, i++) {
                vi word = vi_set1(background);
                if (s.visible[i]) {
                    shaded_lanes p;
                    vf rgb[3];
                    find_pixels(&p, &s, i, column);
                    shade_pixels(&p, row, depth + at + x, rgb);
                    const vi r = to_byte(shading->show, rgb[0]), g = to_byte(shading->show, rgb[1]), b = to_byte(shading->show, rgb[2]);
                    word = vi_select(p.visible, to_word(r, g, b, vi_set1(255)), word);
                }
                if (n - x >= TL_LANES)
                    vi_store((int32_t *)pixels + at + x, word);
                else
                    vi_store_masked((int32_t *)pixels + at + x, vm_first(n - x), word);
            }
        }
}

/* Copies rows [first, end) of four numbers, the last of them replaced by 1/w of the vertex. */
static void set_inverse_w(const tl_source *source, const float *rows, int64_t first, int64_t end, float *restrict out)
{
    int64_t i = first;
    for (; TL_LANES > 1 && source->scalar == TL_F32 && source->matrix && i + TL_LANES <= end && i + TL_LANES < source->n; i += TL_LANES) {
        vf p[4];
        clip_lanes_f32((const float *)source->data + 3 * i, (const float *)source->matrix, 3, p);
        vf_store_fourths(rows + 4 * i, vf_div(vf_set1(1.0f), p[3]), out + 4 * i);
    }
    for (; i < end; i++) {
        double p[4];
        clip_position(source, i, p);
        for (int k = 0; k < 3; k++)
            out[4 * i + k] = rows[4 * i + k];
        out[4 * i + 3] = source->scalar == TL_F32 ? 1.0f / (float)p[3] : (float)(1.0 / p[3]);
    }
}
