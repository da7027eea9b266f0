/* Grey light: a surface of one colour under white lights, where all channels are that colour times the same light.
 * In: the pixels of runs.  Out: their red, green, blue and opacity.
 *
 * The curve of sRGB is a power: that of a product is the product of the powers.  So one root is taken for three channels, of the
 * light as it is, where encode_srgb takes one of each channel's, rounded to a step. */
#include "lanes.h"
#include "shading.h"

/* The most light that can be: its root is taken in steps of 2^-10. */
#define TL_MOST_GREY 63.0f
#define TL_GREY_STEPS 1024.0f

/* 2^(35 / 12) / (255 * 1.055): what the product of two roots is too little by, of a colour in steps of 2^-15 and light in those of
 * 2^-10, where srgb_root has those of 2^-16; and its factor, which stands in both. */
#define TL_GREY_SCALE 0x1.cbddbcp-6f

static int is_white(const float *color) { return color[0] == color[1] && color[1] == color[2]; }

/* Whether what is to be shown has one colour and white light, and not too much of it; the roots of the colour if so. */
static void start_grey(shade_runs *s)
{
    const tl_shading *shading = s->shading;
    const tl_material *m = shading->materials;
    float most = shading->ambient[0];
    s->is_grey = is_white(shading->ambient) && shading->show == TL_SHOW_LIGHT && !shading->material_of && shading->n_materials > 0 &&
                 !m->is_unlit && !m->texture && m->back_side == 0.0f && !(m->shininess > 0.0f) && !s->needs_q;
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

TL_INLINE vi grey_word(shaded_lanes *p)
{
    const shade_runs *s = p->s;
    const vf last = vf_set1(255.0f), line_end = vf_set1(SRGB_LINE_END * SRGB_SLOPE / TL_LIGHT_STEPS);
    lit_surface surface;
    vf diffuse[3], specular[3], scale;
    vi byte[3];
    set_normals(p);
    for (int axis = 0; axis < 3; axis++)
        surface.normal[axis] = p->normal[axis], surface.point[axis] = surface.to_eye[axis] = vf_set1(0.0f); /* nothing shines */
    add_lights(&surface, s->shading, 0.0f, diffuse, specular);
    const vf steps = vf_mul(diffuse[0], vf_set1(TL_GREY_STEPS)), root = srgb_root(steps, &scale), curve = vf_mul(root, scale);
    for (int c = 0; c < 3; c++) {
        const vf line = vf_mul(steps, vf_set1(s->grey_line[c])), bent = vf_fma(curve, vf_set1(s->grey_root[c]), vf_set1(-SRGB_OFFSET));
        byte[c] = vi_rint(vf_min(vf_select(vf_lt(line, line_end), line, bent), last));
    }
    return to_word(byte[0], byte[1], byte[2], vi_set1(255));
}
