/* Snap: pixel coordinates to fixed point, once, ties to even.  In: vertices in pixels.  Out: vertex records. */
#include "fixed.h"

/* float32 widens to float64 without loss, and a power of two scales without loss: rint is the only rounding. */
#define TL_SNAP_FLOATS(NAME, SCALAR)                                                                                     \
    static tl_vertex_counts NAME(const SCALAR *restrict v, int n_components, int64_t n, int subpixel_bits,              \
                                 int with_depth, tl_vertex *restrict out, tl_wide *restrict wide)                       \
    {                                                                                                                    \
        tl_vertex_counts counts = {0, 0, 0};                                                                             \
        const double scale = (double)(1 << subpixel_bits);                                                               \
        for (int64_t i = 0; i < n; i++, v += n_components)                                                               \
            store_vertex(rint((double)v[0] * scale), rint((double)v[1] * scale), with_depth ? (double)v[2] : 0.0, i,     \
                         out, wide, &counts);                                                                            \
        return counts;                                                                                                   \
    }

TL_SNAP_FLOATS(snap_f32, float)
TL_SNAP_FLOATS(snap_f64, double)

/* Integer pixels are shifted as integers: a float64 would lose the last bits beyond 2^53. */
static tl_vertex_counts snap_i64(const int64_t *restrict v, int n_components, int64_t n, int subpixel_bits, int with_depth,
                                 tl_vertex *restrict out, tl_wide *restrict wide)
{
    tl_vertex_counts counts = {0, 0, 0};
    const int64_t narrow = ((int64_t)1 << 30 >> subpixel_bits) - 1, limit = ((int64_t)1 << 62 >> subpixel_bits) - 1;
    for (int64_t i = 0; i < n; i++, v += n_components) {
        const int64_t x = v[0], y = v[1], unit = (int64_t)1 << subpixel_bits;
        const double z = with_depth ? (double)v[2] : 0.0;
        if (x >= -narrow && x <= narrow && y >= -narrow && y <= narrow) {
            out[i] = (tl_vertex){(int32_t)(x * unit), (int32_t)(y * unit), z};
        } else if (x >= -limit && x <= limit && y >= -limit && y <= limit) {
            out[i] = (tl_vertex){TL_SPECIAL, TL_WIDE, z};
            counts.n_wide++;
            if (wide)
                wide[i] = (tl_wide){x * unit, y * unit};
        } else {
            out[i] = (tl_vertex){TL_SPECIAL, TL_BAD, z};
            counts.n_bad++;
        }
    }
    return counts;
}

static tl_vertex_counts snap(const void *vertices_px, tl_scalar scalar, int n_components, int64_t n, int subpixel_bits,
                             int with_depth, tl_vertex *out, tl_wide *wide)
{
    with_depth = with_depth && n_components > 2;
    switch (scalar) {
    case TL_F32: return snap_f32(vertices_px, n_components, n, subpixel_bits, with_depth, out, wide);
    case TL_F64: return snap_f64(vertices_px, n_components, n, subpixel_bits, with_depth, out, wide);
    default: return snap_i64(vertices_px, n_components, n, subpixel_bits, with_depth, out, wide);
    }
}

static int64_t first_bad(const tl_vertex *vertices, const int32_t *triangles, int64_t n_triangles)
{
    int64_t first = -1;
    for (int64_t i = 0; i < 3 * n_triangles; i++) {
        const tl_vertex v = vertices[triangles[i]];
        if (v.x_fx == TL_SPECIAL && v.y_fx == TL_BAD && (first < 0 || triangles[i] < first))
            first = triangles[i];
    }
    return first;
}
