/* Span list: the instances that the pixels of a span show, and runs of one after the other.
 * In: ids that count the triangles of all instances of a picture.  Out: for each instance that shows the columns from
 * the first to the last that do; runs that are set for it.
 *
 * Each instance of a span is shaded by itself, in those columns; where instances alternate from pixel to pixel they
 * are looked at by each of them. */
#ifndef TL_SPAN_LIST_C
#define TL_SPAN_LIST_C

#include <stdint.h>
#include <string.h>

#include "shading.h"
#include "topleft.h"
#include "lanes/lanes.h"
#include "pixels/runs.c"
#include "shade/full.c"
#include "shade/prefetch.c"
#include "shade/srgb.c"

typedef struct {
    const tl_shaded *instance;
    int first, end; /* columns of the span */
} span_part;

typedef struct {
    const tl_shaded_scene *scene;
    const tl_shaded *last, *set; /* the last that was found; that for which runs are set */
    tl_snapped seen;             /* the mesh of that, as the sample sees it that is shaded */
    int n;
    span_part parts[TL_SPAN];
} span_list;

/* Notes the needs of a full material. */
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

/* Runs of nothing yet. */
static void start_runs(shade_runs *s, const tl_window *window, const tl_view *view)
{
    s->window = window, s->view = view, s->first_id = 0;
    memset(s->ints, 0, sizeof s->ints);
    for (int k = 0; k < N_RUN_FLOATS; k++)
        memset(s->floats[k], 0, TL_MAX_LANES * sizeof(float));
}

/* Runs of a mesh from now on, and the needs of its shading. */
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
    s->is_plain = s->needs_normal && !s->needs_q && !shading->face_normals && !shading->normal_of_corner &&
                  !shading->finds_inverse_w && s->window->subpixel_bits > 0;
    note_far(s);
    start_grey(s);
}

static void start_list(span_list *list, const tl_shaded_scene *scene)
{
    list->scene = scene, list->last = scene->instances, list->set = NULL;
}

/* The last of the instances with a first id not above `id`, or the first of all. */
static const tl_shaded *find_instance(const tl_shaded_scene *scene, int32_t id)
{
    int64_t low = 0, high = scene->n;
    while (high - low > 1) {
        const int64_t middle = low + (high - low) / 2;
        if (scene->instances[middle].first_id <= id)
            low = middle;
        else
            high = middle;
    }
    return &scene->instances[low];
}

/* The first of the ids from x on that is not one of [low, high]; n if there is none. */
TL_INLINE int end_of_ids(const int32_t *ids, int x, int n, int32_t low, int32_t high)
{
    for (; x < n; x += TL_LANES) {
        const vm inside = vm_first(n - x);
        const vi id = vi_load_masked(inside, ids + x);
        const vm others = vm_and(inside, vm_or(vi_gt(vi_set1(low), id), vi_gt(id, vi_set1(high))));
        if (vm_any(others))
            return x + __builtin_ctz(vm_bits(others));
    }
    return n;
}

/* Notes that an instance shows in [first, end). */
static void note_part(span_list *list, const tl_shaded *instance, int first, int end)
{
    int k = list->n - 1;
    while (k >= 0 && list->parts[k].instance != instance)
        k--;
    if (k < 0) {
        k = list->n++;
        list->parts[k].instance = instance, list->parts[k].first = first;
    }
    list->parts[k].end = end;
}

/* Lists the instances of n ids. */
TL_ONCE void list_instances(span_list *list, const int32_t *ids, int n)
{
    list->n = 0;
    if (list->scene->n == 1) {
        note_part(list, list->scene->instances, 0, n);
        return;
    }
    for (int x = 0; x < n;) {
        const int32_t id = ids[x];
        const tl_shaded *own = list->last;
        if (id < 0) {
            x = end_of_ids(ids, x, n, INT32_MIN, -1);
            continue;
        }
        if (id < own->first_id || id - own->first_id >= own->snapped->n_triangles)
            list->last = own = find_instance(list->scene, id);
        const int32_t end = own->first_id + (int32_t)own->snapped->n_triangles - 1;
        const int first = x;
        if (id < own->first_id || id > end) { /* of none */
            x++;
            continue;
        }
        x = end_of_ids(ids, x, n, own->first_id, end);
        note_part(list, own, first, x);
    }
}

/* Sets up runs for part k of a span, seen from the sample at_fx, or, without one, from where its mesh is seen. */
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
