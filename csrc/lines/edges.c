/* The edges of the triangles that are not culled, each shared edge once, by ascending lower index; the ends of the line
 * of an edge, and which of its pixels are visible.
 * In: triangles; two vertices, snapped or cut by a clip plane.  Out: pairs of vertices, the lower index first; two ends
 * in fixed point, in an order that depends on the edge alone.
 *
 * A counting sort by the lower index, then a scan of the list of each vertex: 2.9 ns an edge of a triangle of
 * blob(100k), where sorting all pairs takes twenty times as long, and a table of recent edges misses half of them. */
#ifndef TL_EDGES_C
#define TL_EDGES_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "vertex/clip.c"
#include "vertex/project.c"
#include "raster/sides.c"

/* Sorts the corners: the lowest is the lower index of two edges, the middle corner of the third. */
static inline void sort_corners(const int32_t *c, int32_t *sorted)
{
    const int32_t low = c[0] < c[1] ? c[0] : c[1], high = c[0] < c[1] ? c[1] : c[0];
    const int32_t middle = low < c[2] ? c[2] : low;
    sorted[0] = low < c[2] ? low : c[2];
    sorted[1] = middle < high ? middle : high;
    sorted[2] = middle < high ? high : middle;
}

/* Adds the number of edges of each lower index to counts[1 + index], and lists the sorted corners of the *n_listed
 * triangles that are not culled: low | middle << 32 and high.  Returns the first row with an index outside the
 * vertices, or -1. */
static int64_t count_edges(const tl_snapped *snapped, int64_t *restrict counts, uint64_t *restrict listed,
                           int64_t *n_listed)
{
    const uint32_t n_vertices = (uint32_t)snapped->mesh.n_vertices;
    int64_t n = 0;
    for (int64_t i = 0; i < snapped->n_triangles; i++) {
        const int32_t *given = snapped->triangles + 3 * i, c[3] = {given[0], given[1], given[2]};
        int32_t sorted[3];
        if ((uint32_t)c[0] >= n_vertices || (uint32_t)c[1] >= n_vertices || (uint32_t)c[2] >= n_vertices)
            return i;
        if (snapped->cull != TL_CULL_NONE && !shows_side(snapped, i))
            continue;
        sort_corners(c, sorted);
        counts[1 + sorted[0]] += 2;
        counts[1 + sorted[1]]++;
        listed[2 * n] = (uint64_t)sorted[1] << 32 | (uint64_t)sorted[0];
        listed[2 * n + 1] = (uint64_t)sorted[2];
        n++;
    }
    *n_listed = n;
    return -1;
}

/* Writes the higher indices, grouped by lower index; starts[v] becomes the end of the group of v. */
static void group_edges(const uint64_t *restrict listed, int64_t n, int64_t *restrict starts, int32_t *restrict highs)
{
    for (int64_t i = 0; i < n; i++) {
        const int32_t low = (int32_t)listed[2 * i], middle = (int32_t)(listed[2 * i] >> 32);
        const int32_t high = (int32_t)listed[2 * i + 1];
        const int64_t at = starts[low];
        highs[at] = middle;
        highs[at + 1] = high;
        starts[low] = at + 2;
        highs[starts[middle]++] = high;
    }
}

static int64_t list_edges(const tl_snapped *snapped, const tl_edge_scratch *scratch, uint64_t *restrict edges,
                          int64_t *n_edges)
{
    const int64_t n_vertices = snapped->mesh.n_vertices;
    int64_t *restrict starts = scratch->starts, n = 0, n_listed = 0;
    int32_t *restrict highs = scratch->highs, *restrict last_low = scratch->last_low;
    memset(starts, 0, (size_t)(n_vertices + 1) * sizeof *starts);
    memset(last_low, 0xff, (size_t)n_vertices * sizeof *last_low);
    /* corners are stored in the memory of the edges: two of the three numbers that each triangle has there */
    const int64_t bad_row = count_edges(snapped, starts, edges, &n_listed);
    if (bad_row >= 0)
        return bad_row;
    for (int64_t v = 0; v < n_vertices; v++)
        starts[v + 1] += starts[v];
    group_edges(edges, n_listed, starts, highs);
    for (int64_t low = 0, k = 0; low < n_vertices; low++)
        for (; k < starts[low]; k++) {
            const int32_t high = highs[k];
            edges[n] = (uint64_t)high << 32 | (uint64_t)low;
            n += last_low[high] != (int32_t)low; /* without a branch: it is unpredictable */
            last_low[high] = (int32_t)low;
        }
    *n_edges = n;
    return -1;
}

#define TL_MAX_PIXELS 4096 /* pixels listed before they are stored: 16 KB a list, in the first-level cache */

typedef struct {
    int64_t x_fx, y_fx;
    double z;
} line_end;

static inline line_end snapped_end(tl_vertex v, tl_wide wide)
{
    return v.x_fx == TL_SPECIAL ? (line_end){wide.x_fx, wide.y_fx, v.z} : (line_end){v.x_fx, v.y_fx, v.z};
}

/* Clips an edge as `clip_polygon` cuts it.  Only planes that an end is outside of cut it, so the line does not depend
 * on the triangles that share it. */
static int cut_line(const tl_source *source, const int32_t *edge, const tl_view *view, line_end *ends)
{
    clip_corner p[2];
    unsigned out[2];
    for (int k = 0; k < 2; k++) {
        memset(p[k].weights, 0, sizeof p[k].weights);
        clip_position(source, edge[k], p[k].pos);
        out[k] = outside_planes(p[k].pos, view);
    }
    if (out[0] & out[1])
        return 0;
    for (int plane = 0; plane < TL_N_PLANES; plane++) {
        if (!((out[0] | out[1]) >> plane & 1))
            continue;
        const double d0 = plane_distance(p[0].pos, plane, view), d1 = plane_distance(p[1].pos, plane, view);
        if (d0 < 0.0 && d1 < 0.0)
            return 0;
        if (d0 < 0.0)
            p[0] = cut_edge(p + 1, p, d1, d0, plane, view);
        else if (d1 < 0.0)
            p[1] = cut_edge(p, p + 1, d0, d1, plane, view);
    }
    tl_vertex_counts counts = {0, 0, 0};
    tl_vertex v[2];
    tl_wide wide[2] = {{0, 0}, {0, 0}};
    for (int k = 0; k < 2; k++) {
        if (!(p[k].pos[3] >= TL_MIN_W * 0.5))
            return 0;
        store_projected(p[k].pos, view, k, v, wide, 1, &counts);
        ends[k] = snapped_end(v[k], wide[k]);
    }
    return counts.n_bad == 0;
}

/* Sets the ends of an edge, the upper end first, for a level edge the left end: both triangles of an edge then draw one
 * line.  Returns 0 when the clip planes remove it. */
static int find_ends(const tl_edges *lines, const int32_t *edge, line_end *ends)
{
    const tl_vertex *v = lines->mesh.vertices;
    int clipped = 0;
    for (int k = 0; k < 2; k++)
        clipped |= v[edge[k]].x_fx == TL_SPECIAL && v[edge[k]].y_fx == TL_CLIPPED;
    if (clipped && !cut_line(lines->mesh.source, edge, lines->view, ends))
        return 0;
    for (int k = 0; k < 2 && !clipped; k++) {
        const tl_wide at = vertex_fx(&lines->mesh, edge[k]);
        ends[k] = (line_end){at.x_fx, at.y_fx, v[edge[k]].z};
    }
    if (ends[0].y_fx > ends[1].y_fx || (ends[0].y_fx == ends[1].y_fx && ends[0].x_fx > ends[1].x_fx)) {
        const line_end first = ends[0];
        ends[0] = ends[1], ends[1] = first;
    }
    return 1;
}

/* Whether a line at this depth is visible at a pixel. */
static inline int shows_depth(const tl_line_target *target, int64_t at, float z)
{
    const double away = target->is_farthest ? -1.0 : 1.0;
    return away * (double)z <= away * (double)target->depth[at] + target->depth_bias;
}

#endif
