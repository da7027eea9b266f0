/* Clip: object space to clip space, clip space to the screen, and the triangles that a clip plane cuts.
 * In: homogeneous vertices.  Out: vertex records, 1/w, and the pieces of cut triangles.
 * Based on: I. E. Sutherland, G. W. Hodgman, Reentrant Polygon Clipping, 1974. */
#include <string.h>

#include "fixed.h"

/* w, near, far, -x, +x, -y, +y: the order in which a polygon meets the planes */
#define TL_N_PLANES 7
#define TL_MAX_CORNERS (3 + TL_N_PLANES)
#define TL_MIN_W 0x1p-500 /* keeps 1/w and x/w from overflowing */

typedef struct {
    double pos[4];     /* x, y, z, w */
    double weights[3]; /* barycentrics in the source triangle */
} clip_corner;

static void transform_f32(const float *restrict v, int64_t n, const float *restrict m, double *restrict out)
{
    for (int64_t i = 0; i < n; i++, v += 3, out += 4)
        for (int row = 0; row < 4; row++)
            out[row] = (double)(((m[4 * row] * v[0] + m[4 * row + 1] * v[1]) + m[4 * row + 2] * v[2]) + m[4 * row + 3]);
}

static void transform_f64(const double *restrict v, int64_t n, const double *restrict m, double *restrict out)
{
    for (int64_t i = 0; i < n; i++, v += 3, out += 4)
        for (int row = 0; row < 4; row++)
            out[row] = ((m[4 * row] * v[0] + m[4 * row + 1] * v[1]) + m[4 * row + 2] * v[2]) + m[4 * row + 3];
}

/* Signed distance from a plane, >= 0 inside. */
static inline double plane_distance(const double *p, int plane, const tl_view *view)
{
    const double x = p[0], y = p[1], z = p[2], w = p[3];
    switch (plane) {
    case 0: return w - TL_MIN_W;
    case 1: return !view->near_clip ? 1.0 : view->zero_to_one ? z : z + w;
    case 2: return !view->far_clip ? 1.0 : w - z;
    case 3: return view->guard_band_x * w + x;
    case 4: return view->guard_band_x * w - x;
    case 5: return view->guard_band_y * w + y;
    default: return view->guard_band_y * w - y;
    }
}

static inline unsigned outside_planes(const double *p, const tl_view *view)
{
    unsigned out = 0;
    for (int plane = 0; plane < TL_N_PLANES; plane++)
        out |= (unsigned)!(plane_distance(p, plane, view) >= 0.0) << plane;
    return out;
}

/* Perspective divide and viewport.  x_px = (x/w + 1) * (width/2), each operation rounded once. */
static inline void store_projected(const double *p, const tl_view *view, int64_t i, tl_vertex *out, tl_wide *wide, double *inv_w,
                                   int was_cut, tl_vertex_counts *counts)
{
    const double unit = (double)(1 << view->subpixel_bits);
    const double x_px = (p[0] / p[3] + 1.0) * view->half_width_px, y_px = (1.0 - p[1] / p[3]) * view->half_height_px;
    double z = view->zero_to_one ? p[2] / p[3] : (p[2] / p[3] + 1.0) * 0.5;
    if (was_cut && view->near_clip)
        z = z < 0.0 ? 0.0 : z; /* a cut lies on its plane but for rounding */
    if (was_cut && view->far_clip)
        z = z > 1.0 ? 1.0 : z;
    z = z > FLT_MAX ? FLT_MAX : z < -FLT_MAX ? -FLT_MAX : z; /* only without near and far planes */
    store_vertex(rint(x_px * unit), rint(y_px * unit), z, i, out, wide, counts);
    inv_w[i] = 1.0 / p[3];
}

static tl_vertex_counts project(const double *vertices_clip, int64_t n, const tl_view *view, tl_vertex *out, tl_wide *wide,
                                double *inv_w)
{
    tl_vertex_counts counts = {0, 0, 0};
    for (int64_t i = 0; i < n; i++) {
        const double *p = vertices_clip + 4 * i;
        inv_w[i] = 0.0;
        if (!(isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]) && isfinite(p[3]))) {
            out[i] = (tl_vertex){TL_SPECIAL, TL_BAD, 0.0};
            counts.n_bad++;
        } else if (outside_planes(p, view)) {
            out[i] = (tl_vertex){TL_SPECIAL, TL_CLIPPED, 0.0};
            counts.n_clipped++;
        } else {
            store_projected(p, view, i, out, wide, inv_w, 0, &counts);
        }
    }
    return counts;
}

/* The point where the edge from a (inside) to b (outside) meets the plane: both weights are positive, so w stays so. */
static inline clip_corner cut_edge(const clip_corner *a, const clip_corner *b, double da, double db)
{
    clip_corner cut;
    const double of_a = -db / (da - db), of_b = da / (da - db);
    for (int k = 0; k < 4; k++)
        cut.pos[k] = a->pos[k] * of_a + b->pos[k] * of_b;
    for (int k = 0; k < 3; k++)
        cut.weights[k] = a->weights[k] * of_a + b->weights[k] * of_b;
    return cut;
}

/* Cuts a convex polygon by one plane; returns the new number of corners. */
static int clip_polygon(const clip_corner *in, int n_in, int plane, const tl_view *view, clip_corner *out)
{
    int n = 0;
    for (int k = 0; k < n_in; k++) {
        const clip_corner *a = in + k, *b = in + (k + 1) % n_in;
        const double da = plane_distance(a->pos, plane, view), db = plane_distance(b->pos, plane, view);
        if (da >= 0.0)
            out[n++] = *a;
        if (da >= 0.0 && db < 0.0)
            out[n++] = cut_edge(a, b, da, db);
        else if (da < 0.0 && db >= 0.0)
            out[n++] = cut_edge(b, a, db, da);
    }
    return n;
}

/* What is left of one triangle; 0 corners when nothing is. */
static int clip_triangle(const double *vertices_clip, const int32_t *corners, const tl_view *view, clip_corner *polygon)
{
    clip_corner other[TL_MAX_CORNERS];
    unsigned any = 0, all = ~0u;
    for (int k = 0; k < 3; k++) {
        memcpy(polygon[k].pos, vertices_clip + 4 * (int64_t)corners[k], sizeof polygon[k].pos);
        for (int j = 0; j < 3; j++)
            polygon[k].weights[j] = j == k;
        const unsigned out = outside_planes(polygon[k].pos, view);
        any |= out;
        all &= out;
    }
    if (all)
        return 0;
    int n = 3;
    for (int plane = 0; plane < TL_N_PLANES && n; plane++) {
        if (!(any >> plane & 1))
            continue;
        n = clip_polygon(polygon, n, plane, view, other);
        memcpy(polygon, other, sizeof *polygon * (size_t)n);
    }
    for (int k = 0; k < n; k++)
        if (!(polygon[k].pos[3] >= TL_MIN_W * 0.5)) /* overflowed or underflowed in the cut: beyond any picture */
            return 0;
    return n < 3 ? 0 : n;
}

static inline tl_wide snapped_corner(const tl_pieces *p, int64_t i)
{
    if (p->vertices[i].x_fx == TL_SPECIAL)
        return p->wide[i];
    return (tl_wide){p->vertices[i].x_fx, p->vertices[i].y_fx};
}

static inline int fan_sign(const tl_pieces *p, int64_t first, int n, int apex, int i)
{
    const tl_wide a = snapped_corner(p, first + apex), b = snapped_corner(p, first + (apex + i) % n),
                  c = snapped_corner(p, first + (apex + i + 1) % n);
    const tl_int128 area = ((tl_int128)b.x_fx - a.x_fx) * ((tl_int128)c.y_fx - a.y_fx) -
                           ((tl_int128)b.y_fx - a.y_fx) * ((tl_int128)c.x_fx - a.x_fx);
    return (area > 0) - (area < 0);
}

/* The snap may dent a corner of the convex polygon inwards; a fan from that corner still turns one way only.
 * Returns that sign in *sign; when no apex does it (two corners changed places), the sign of the first fan's sum. */
static int fan_apex(const tl_pieces *p, int64_t first, int n, int *sign)
{
    for (int apex = 0; apex < n; apex++) {
        int has_positive = 0, has_negative = 0;
        for (int i = 1; i < n - 1; i++) {
            has_positive |= fan_sign(p, first, n, apex, i) > 0;
            has_negative |= fan_sign(p, first, n, apex, i) < 0;
        }
        *sign = has_positive - has_negative;
        if (!(has_positive && has_negative))
            return apex;
    }
    double area = 0.0; /* only its sign matters, and only for polygons a few sub-pixels thin */
    for (int i = 1; i < n - 1; i++) {
        const tl_wide a = snapped_corner(p, first), b = snapped_corner(p, first + i), c = snapped_corner(p, first + i + 1);
        area += ((double)b.x_fx - (double)a.x_fx) * ((double)c.y_fx - (double)a.y_fx) -
                ((double)b.y_fx - (double)a.y_fx) * ((double)c.x_fx - (double)a.x_fx);
    }
    *sign = area >= 0.0 ? 1 : -1;
    return 0;
}

/* Snaps the polygon of one triangle and appends its fan. */
static void append_pieces(tl_pieces *p, const clip_corner *polygon, int n, int32_t source, const tl_view *view)
{
    const int64_t first = p->n_vertices;
    tl_vertex_counts counts = {0, 0, 0};
    for (int k = 0; k < n; k++) {
        store_projected(polygon[k].pos, view, first + k, p->vertices, p->wide, p->inv_w, 1, &counts);
        memcpy(p->weights + 3 * (first + k), polygon[k].weights, sizeof polygon[k].weights);
    }
    if (counts.n_bad)
        return; /* beyond 2^62 in spite of the guard band: not representable, so not drawn */
    int sign;
    const int apex = fan_apex(p, first, n, &sign);
    for (int i = 1; i < n - 1; i++) {
        if (fan_sign(p, first, n, apex, i) * sign <= 0)
            continue;
        int32_t *t = p->triangles + 3 * p->n_pieces;
        t[0] = (int32_t)(first + apex);
        t[1] = (int32_t)(first + (apex + i) % n);
        t[2] = (int32_t)(first + (apex + i + 1) % n);
        p->source[p->n_pieces++] = source;
    }
    p->n_vertices += n;
}

static void clip(const double *vertices_clip, const tl_vertex *vertices, const int32_t *triangles, int64_t n_triangles,
                 const tl_view *view, tl_pieces *pieces)
{
    clip_corner polygon[TL_MAX_CORNERS];
    pieces->n_vertices = pieces->n_pieces = 0;
    for (int64_t t = 0; t < n_triangles; t++) {
        const int32_t *corners = triangles + 3 * t;
        int cut = 0;
        for (int k = 0; k < 3; k++)
            cut |= vertices[corners[k]].x_fx == TL_SPECIAL && vertices[corners[k]].y_fx == TL_CLIPPED;
        const int n = cut ? clip_triangle(vertices_clip, corners, view, polygon) : 0;
        if (n && pieces->vertices) {
            append_pieces(pieces, polygon, n, (int32_t)t, view);
        } else if (n) {
            pieces->n_vertices += n;
            pieces->n_pieces += n - 2;
        }
    }
}
