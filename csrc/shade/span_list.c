/* Span list: sets up runs for the instances of a span, one after the other.
 * In: the columns in which each instance is visible.  Out: runs that are set up for it. */
#ifndef TL_SPAN_LIST_C
#define TL_SPAN_LIST_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "pixels/instances.c"
#include "pixels/runs.c"
#include "pixels/shading.h"
#include "shade/full.c"
#include "shade/srgb.c"

/* Adds what a full material needs of runs. */
static void note_full(shade_runs *s, const tl_material *m)
{
    const tl_texture *textures[TL_MAX_TEXTURES];
    const int n = textures_of(m, textures);
    for (int k = 0; k < n; k++) {
        s->needs_uv |= textures[k]->uv_set == 0;
        s->needs_uv1 |= textures[k]->uv_set == 1;
    }
    if (m->normal_map && !m->is_unlit)
        s->needs_tangents[m->normal_map->uv_set] = 1;
}

/* Starts runs without a mesh. */
static void start_runs(shade_runs *s, const tl_window *window, const tl_view *view)
{
    s->window = window, s->view = view, s->first_id = 0;
    memset(s->ints, 0, sizeof s->ints);
    for (int k = 0; k < N_RUN_FLOATS; k++)
        memset(s->floats[k], 0, TL_MAX_LANES * sizeof(float));
}

/* Sets the mesh of the runs, and what its shading needs. */
static void set_mesh(shade_runs *s, const tl_snapped *snapped, const tl_shading *shading)
{
    int shines = 0, has_texture = 0, is_lit = 0, has_points = 0;
    const int shows_light = shading->show == TL_SHOW_LIGHT;
    s->snapped = snapped, s->shading = shading;
    s->needs_uv = s->needs_uv1 = s->needs_tangents[0] = s->needs_tangents[1] = 0;
    for (int k = 0; k < shading->n_materials; k++) {
        const tl_material *m = &shading->materials[k];
        has_texture |= m->texture != NULL && !m->is_full;
        is_lit |= !m->is_unlit;
        shines |= !m->is_unlit && (m->shininess > 0.0f || m->is_metallic);
        if (m->is_full && shows_light)
            note_full(s, m);
    }
    for (int k = 0; k < shading->n_lights; k++)
        has_points |= shading->lights[k].kind == TL_LIGHT_POINT || shading->lights[k].kind == TL_LIGHT_SPOT;
    s->needs_normal = !shows_light || is_lit;
    s->needs_uv = shading->uv && (s->needs_uv || (shows_light && has_texture));
    s->needs_uv1 &= shading->uv1 != NULL;
    s->needs_tangents[0] &= shading->uv != NULL, s->needs_tangents[1] &= shading->uv1 != NULL;
    s->needs_colors = shows_light && shading->colors;
    s->needs_alpha = s->needs_colors && shading->has_alpha && shading->wants_opacity;
    s->needs_point = shows_light && ((is_lit && has_points) || shines);
    s->needs_more = s->needs_uv1 || s->needs_alpha || s->needs_tangents[0] || s->needs_tangents[1];
    s->needs_q = s->needs_uv || s->needs_more || s->needs_colors || s->needs_point || shading->fog_scale != 0.0f;
    start_grey(s);
}

/* Sets up runs for part k of a span, for the sample at_fx; NULL: for the sample of its mesh. */
TL_INLINE void set_part(shade_runs *s, span_list *list, int k, const int32_t *at_fx)
{
    const tl_shaded *own = list->parts[k].instance;
    if (own != list->set) {
        list->set = own, list->seen = *own->snapped;
        set_mesh(s, &list->seen, own->shading);
        s->first_id = own->first_id;
    }
    if (at_fx)
        list->seen.mesh.sample_x_fx = at_fx[0], list->seen.mesh.sample_y_fx = at_fx[1];
}

#endif
