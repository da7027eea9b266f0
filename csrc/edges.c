/* Edges: those of the triangles that are not culled, each shared one once, by ascending lower index.
 * In: triangles.  Out: pairs of vertices, the lower index first.
 *
 * A counting sort by the lower index, then a look at each vertex's own list.  The order costs nothing and draws faster than
 * that of the triangles: neighbours in memory are mostly neighbours in the picture (blob(100k), whose triangles stand in
 * random order: TODO). */
#include "fixed.h"

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
    const tl_vertex_set cut = piece_set(p);
    for (int64_t k = first_piece(p, i); k < p->n_pieces && p->source[k] == i; k++)
        if (load_triangle(&cut, p->triangles + 3 * k, &t) == wanted)
            return 1;
    return 0;
}

/* Lists the three edges of each triangle and counts those of each lower index, in counts[1 + index].  Returns the first row
 * with an index outside the vertices, or -1. */
static int64_t count_edges(const tl_scene *scene, int64_t *restrict counts, uint64_t *restrict edges, int64_t *n_edges)
{
    const uint32_t n_vertices = (uint32_t)scene->mesh.n_vertices;
    int64_t n = 0;
    for (int64_t i = 0; i < scene->n_triangles; i++) {
        const uint32_t *c = (const uint32_t *)scene->triangles + 3 * i;
        if (c[0] >= n_vertices || c[1] >= n_vertices || c[2] >= n_vertices)
            return i;
        if (scene->cull != TL_CULL_NONE && !shows_side(scene, i))
            continue;
        for (int k = 0; k < 3; k++) {
            const uint32_t a = c[k], b = c[k == 2 ? 0 : k + 1], low = a < b ? a : b, high = a < b ? b : a;
            edges[n++] = (uint64_t)high << 32 | low;
            counts[1 + low]++;
        }
    }
    *n_edges = n;
    return -1;
}

static int64_t list_edges(const tl_scene *scene, const tl_edge_scratch *scratch, uint64_t *restrict edges, int64_t *n_edges)
{
    const int64_t n_vertices = scene->mesh.n_vertices;
    int64_t *restrict starts = scratch->starts, n = 0;
    int32_t *restrict highs = scratch->highs, *restrict last_low = scratch->last_low;
    memset(starts, 0, (size_t)(n_vertices + 1) * sizeof *starts);
    memset(last_low, 0xff, (size_t)n_vertices * sizeof *last_low);
    const int64_t bad_row = count_edges(scene, starts, edges, &n);
    if (bad_row >= 0)
        return bad_row;
    for (int64_t v = 0; v < n_vertices; v++)
        starts[v + 1] += starts[v];
    for (int64_t k = 0; k < n; k++)
        highs[starts[(uint32_t)edges[k]]++] = (int32_t)(edges[k] >> 32);
    /* starts[v] is now where the list of v ends */
    n = 0;
    for (int64_t low = 0, k = 0; low < n_vertices; low++)
        for (; k < starts[low]; k++) {
            const int32_t high = highs[k];
            edges[n] = (uint64_t)high << 32 | (uint64_t)low;
            n += last_low[high] != (int32_t)low; /* no branch: it cannot be predicted */
            last_low[high] = (int32_t)low;
        }
    *n_edges = n;
    return -1;
}
