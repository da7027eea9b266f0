/* Raster: every triangle of a scene, in order, through setup and a walker to the sink.
 * In: vertex records and triangles.  Out: the target's buffers. */
#include "fixed.h"

#define TL_INT int64_t
#define TL_UINT uint64_t
#define TL_WALK(name) name##_64
static inline void floor_divide_64(int64_t a, int64_t b, int64_t *quotient, int64_t *remainder)
{
    const int64_t q = a / b, r = a % b;
    *quotient = q - (r < 0);
    *remainder = r < 0 ? r + b : r;
}
#include "walk.h"
#undef TL_INT
#undef TL_UINT
#undef TL_WALK

#define TL_INT tl_int128
#define TL_UINT tl_uint128
#define TL_WALK(name) name##_128
static inline void floor_divide_128(tl_int128 a, tl_int128 b, tl_int128 *quotient, tl_int128 *remainder)
{
    const tl_int128 q = a / b, r = a % b;
    *quotient = q - (r < 0);
    *remainder = r < 0 ? r + b : r;
}
#include "walk.h"
#undef TL_INT
#undef TL_UINT
#undef TL_WALK

/* A box at most this wide is walked sample by sample, a wider one by its row ends. */
#define TL_EDGE_MAX_WIDTH 6

static inline void draw_triangle(const tl_vertex_set *set, const int32_t *corners, int32_t id, const tl_scene *scene,
                                 const tl_window *window, const tl_target *target)
{
    tl_triangle t;
    const int sign = load_triangle(set, corners, &t);
    if (sign == 0 || (sign > 0 && scene->cull == TL_CULL_BACK) || (sign < 0 && scene->cull == TL_CULL_FRONT))
        return;
    if (!clip_box(&t, window))
        return;
    t.id = id;
    setup_sink(&t, window, target);
    const int by_edge = scene->method == TL_METHOD_EDGE ||
                        (scene->method == TL_METHOD_AUTO && t.col1 - t.col0 <= TL_EDGE_MAX_WIDTH);
    if (t.is_narrow && by_edge)
        walk_edge_64(&t, window, target);
    else if (t.is_narrow)
        walk_scanline_64(&t, window, target);
    else if (by_edge)
        walk_edge_128(&t, window, target);
    else
        walk_scanline_128(&t, window, target);
}

static inline int is_clipped(const tl_vertex_set *set, const int32_t *corners)
{
    int clipped = 0;
    for (int k = 0; k < 3; k++)
        clipped |= set->vertices[corners[k]].x_fx == TL_SPECIAL && set->vertices[corners[k]].y_fx == TL_CLIPPED;
    return clipped;
}

static tl_vertex_set piece_set(const tl_pieces *p)
{
    return (tl_vertex_set){p->vertices, p->wide, p->inv_w, p->n_vertices};
}

static void draw(const tl_scene *scene, const tl_window *window, const tl_target *target)
{
    const tl_pieces *pieces = scene->pieces;
    const tl_vertex_set cut = pieces ? piece_set(pieces) : (tl_vertex_set){0};
    int64_t piece = 0;
    for (int64_t i = 0; i < scene->n_triangles; i++) {
        const int32_t *corners = scene->triangles + 3 * i;
        if (!is_clipped(&scene->mesh, corners)) {
            draw_triangle(&scene->mesh, corners, (int32_t)i, scene, window, target);
            continue;
        }
        for (; pieces && piece < pieces->n_pieces && pieces->source[piece] == i; piece++)
            draw_triangle(&cut, pieces->triangles + 3 * piece, (int32_t)i, scene, window, target);
    }
}
