/* Sides: which side of a triangle shows, after the snap, and triangles of which one side is not drawn.
 * In: a scene.  Out: whether its cull leaves a triangle; triangles, those that it does not leave collapsed. */
#ifndef TL_SIDES_C
#define TL_SIDES_C

#include <stdint.h>

#include "topleft.h"
#include "vertex/clip.c"
#include "raster/setup.c"

/* Whether a triangle shows the side that is drawn: as draw_triangle, of the pieces where a plane cuts it. */
static int shows_side(const tl_scene *scene, int64_t i)
{
    const int32_t *corners = scene->triangles + 3 * i;
    const int wanted = scene->cull == TL_CULL_BACK ? -1 : 1;
    tl_triangle t;
    if (!is_clipped(&scene->mesh, corners))
        return load_triangle(&scene->mesh, corners, &t) == wanted;
    const tl_pieces *p = scene->pieces;
    if (!p)
        return 0;
    const tl_vertex_set cut = piece_set(p, &scene->mesh);
    for (int64_t k = first_piece(p, i); k < p->n_pieces && p->source[k] == i; k++)
        if (load_triangle(&cut, p->triangles + 3 * k, &t) == wanted)
            return 1;
    return 0;
}

/* Collapses the pieces of a triangle that a plane cuts which do not show the side that is drawn. */
static void drop_pieces(const tl_scene *scene, int64_t i)
{
    const tl_pieces *p = scene->pieces;
    const int wanted = scene->cull == TL_CULL_BACK ? -1 : 1;
    tl_triangle t;
    if (!p)
        return;
    const tl_vertex_set cut = piece_set(p, &scene->mesh);
    for (int64_t k = first_piece(p, i); k < p->n_pieces && p->source[k] == i; k++) {
        int32_t *corners = p->triangles + 3 * k;
        if (load_triangle(&cut, corners, &t) != wanted)
            corners[1] = corners[2] = corners[0];
    }
}

/* Copies triangles [first, end), those collapsed to a point that are single-sided and do not show the side that the
 * cull of the scene leaves; of what a plane cuts the pieces instead, in place. */
static void drop_sides(const tl_scene *scene, const uint8_t *is_single, int64_t first, int64_t end, int32_t *triangles)
{
    for (int64_t i = first; i < end; i++) {
        const int32_t *corners = scene->triangles + 3 * i;
        int32_t *own = triangles + 3 * i;
        const int is_cut = is_clipped(&scene->mesh, corners), is_left = !is_single[i] || is_cut || shows_side(scene, i);
        own[0] = corners[0];
        own[1] = is_left ? corners[1] : corners[0];
        own[2] = is_left ? corners[2] : corners[0];
        if (is_single[i] && is_cut)
            drop_pieces(scene, i);
    }
}

#endif
