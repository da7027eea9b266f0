/* The weights of the corners at one pixel, for any triangle.  weights.c computes vectors of pixels.
 * In: a triangle's id and the vertex records it was drawn from.  Out: barycentric weights, float64. */
#ifndef TL_WEIGHTS_ONE_C
#define TL_WEIGHTS_ONE_C

#include <stddef.h>
#include <stdint.h>

#include "topleft.h"
#include "vertex/clip.c"
#include "vertex/exact.h"
#include "vertex/fixed.h"
#include "vertex/project.c"
#include "vertex/setup.c"
#include "exact/sign.c"
#include "pixels/weights_exact.c"

/* The triangle or piece at the last pixel: neighbours mostly share it. */
typedef struct {
    int64_t id; /* -1: empty */
    tl_triangle triangle;
    const double *piece[3]; /* weights of a piece's corners in the source triangle, or NULL */
    double inv_w[3];
    int slot[3]; /* the input triangle's corner of each corner, which may be reordered */
    /* unsnapped, instead of `triangle`: the mesh's vertices, and the corners, not reordered */
    const tl_vertex_set *exact;
    exact_point points[3];
} resolve_state;

static inline int covers(const tl_triangle *t, int64_t x_px, int64_t y_px, int bits)
{
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        const int64_t dy = t->y_fx[next] - t->y_fx[k], dx = t->x_fx[next] - t->x_fx[k];
        const int top_left = dy < 0 || (dy == 0 && dx > 0);
        if (i128_less(doubled_edge(t, k, next, x_px, y_px, bits), i128_from(!top_left)))
            return 0;
    }
    return 1;
}

static double inverse_w(const tl_vertex_set *set, int32_t i)
{
    double p[4];
    if (set->inv_w)
        return set->inv_w[i];
    if (!set->source)
        return 1.0;
    clip_position(set->source, i, p);
    return 1.0 / p[3];
}

static int load_resolved(resolve_state *s, const tl_vertex_set *set, const int32_t *corners)
{
    if (load_triangle(set, corners, &s->triangle) == 0)
        return 0;
    for (int k = 0; k < 3; k++) {
        s->slot[k] = k;
        s->inv_w[k] = inverse_w(set, s->triangle.corner[k]);
    }
    if (s->triangle.corner[1] != corners[1])
        s->slot[1] = 2, s->slot[2] = 1;
    return 1;
}

/* `find_triangle` for vertices that are not snapped. */
static int find_exact(resolve_state *s, const tl_snapped *snapped, int64_t id, const int32_t *corners, int64_t x_px,
                      int64_t y_px, int bits)
{
    const tl_exact_points *points = snapped->mesh.exact;
    for (int k = 0; k < 3; k++) {
        s->slot[k] = k, s->piece[k] = NULL;
        s->points[k] = point_of(points, corners[k]);
        s->inv_w[k] = inverse_w(&snapped->mesh, corners[k]);
        s->triangle.corner[k] = corners[k];
    }
    if (is_clipped(&snapped->mesh, corners)) {
        const tl_pieces *p = points->pieces;
        const int64_t i = piece_at(p, id, sample_of(&snapped->mesh, x_px, y_px, bits), s->points);
        if (i < 0)
            return 0;
        for (int k = 0; k < 3; k++) {
            s->piece[k] = p->weights + 3 * (int64_t)p->triangles[3 * i + k];
            s->inv_w[k] = p->inv_w[p->triangles[3 * i + k]];
        }
    }
    s->exact = &snapped->mesh;
    s->id = id;
    return 1;
}

/* Loads the triangle or piece that the pixel shows into `s`; 0 when the buffer does not belong to the mesh. */
static int find_triangle(resolve_state *s, const tl_snapped *snapped, int64_t id, int64_t x_px, int64_t y_px, int bits)
{
    if (id == s->id && !s->piece[0])
        return 1;
    s->id = -1;
    if (id < 0 || id >= snapped->n_triangles)
        return 0;
    int32_t corners[3];
    for (int k = 0; k < 3; k++) {
        corners[k] = snapped->triangles[3 * id + k];
        if (corners[k] < 0 || corners[k] >= snapped->mesh.n_vertices) /* the caller's array may have changed */
            return 0;
    }
    if (snapped->mesh.exact)
        return find_exact(s, snapped, id, corners, x_px, y_px, bits);
    s->exact = NULL;
    if (!is_clipped(&snapped->mesh, corners)) {
        s->piece[0] = NULL;
        if (!load_resolved(s, &snapped->mesh, corners))
            return 0;
        s->id = id;
        return 1;
    }
    if (!snapped->pieces)
        return 0;
    const tl_pieces *p = snapped->pieces;
    const tl_vertex_set cut = piece_set(p, &snapped->mesh);
    for (int64_t i = first_piece(p->source, p->n_pieces, id); i < p->n_pieces && p->source[i] == id; i++) {
        if (!load_resolved(s, &cut, p->triangles + 3 * i) || !covers(&s->triangle, x_px, y_px, bits))
            continue;
        for (int k = 0; k < 3; k++)
            s->piece[k] = p->weights + 3 * (int64_t)s->triangle.corner[k];
        s->id = id;
        return 1;
    }
    return 0;
}

/* The edge functions opposite the corners of the triangle or piece, of either winding, in proportion. */
static void edges_of_pixel(const resolve_state *s, int64_t x_px, int64_t y_px, int bits, double *e)
{
    if (s->exact) {
        scaled_edges(s->points, sample_of(s->exact, x_px, y_px, bits), e);
        return;
    }
    for (int k = 0; k < 3; k++) {
        const int a = k == 2 ? 0 : k + 1, b = 3 - k - a;
        e[k] = i128_to_f64(doubled_edge(&s->triangle, a, b, x_px, y_px, bits));
    }
}

/* Perspective-correct weights of the input triangle's corners at a pixel: exact edge functions times 1/w,
 * normalised. */
static void weights_of_pixel(const resolve_state *s, int64_t x_px, int64_t y_px, int bits, double *weights)
{
    double part[3], sum = 0.0;
    edges_of_pixel(s, x_px, y_px, bits, part);
    for (int k = 0; k < 3; k++) {
        part[k] *= s->inv_w[k];
        sum += part[k];
    }
    weights[0] = weights[1] = weights[2] = 0.0;
    for (int k = 0; k < 3; k++) {
        if (s->piece[0])
            for (int j = 0; j < 3; j++)
                weights[j] += part[k] / sum * s->piece[k][j];
        else
            weights[s->slot[k]] = part[k] / sum;
    }
}

#endif
