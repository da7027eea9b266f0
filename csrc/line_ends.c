/* Line ends: where the line of an edge begins and ends, and what of it is hidden.
 * In: two vertices, snapped or cut by a clip plane.  Out: two ends in fixed point, in an order that is the edge's own. */
#include "fixed.h"

#define TL_MAX_PIXELS 4096 /* pixels that are listed before they are stored: 16 KB a list, in the first-level cache */

typedef struct {
    int64_t x_fx, y_fx;
    double z;
} line_end;

static inline line_end snapped_end(tl_vertex v, tl_wide wide)
{
    return v.x_fx == TL_SPECIAL ? (line_end){wide.x_fx, wide.y_fx, v.z} : (line_end){v.x_fx, v.y_fx, v.z};
}

/* What the clip planes leave of an edge: the cuts are those of clip_polygon along the same edge.  Only planes that an end
 * is outside of cut it, so the line does not depend on the triangles that share it. */
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

/* The ends of an edge, the upper one first, of a level edge the left one: both sides of an edge then draw the same line.
 * Returns 0 when the clip planes leave nothing. */
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

/* Whether a line at this depth shows at a pixel. */
static inline int shows_depth(const tl_line_target *target, int64_t at, float z)
{
    const double away = target->is_farthest ? -1.0 : 1.0;
    return away * (double)z <= away * (double)target->depth[at] + target->depth_bias;
}
