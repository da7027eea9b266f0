/* Weights: those of the three corners at the pixels of a visibility buffer, from vertices that are not snapped.
 * In: ids, the points they were drawn from.  Out: barycentric weights, or values of the vertices.
 *
 * Weights are in proportion to edge functions over w.  A float64 edge function is taken where its error bound is below
 * 2^-32 of it; elsewhere, near an edge and of slivers, one that is exact to 2^-50.  So each weight is within 2^-30 of
 * its own size, however far apart the w are. */
#ifndef TL_WEIGHTS_EXACT_C
#define TL_WEIGHTS_EXACT_C

#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "exact/project_exact.c"
#include "exact/setup_exact.c"
#include "exact/sign.c"
#include "pixels/weights_one.c"

/* The triangle or piece under the last pixel. */
typedef struct {
    int64_t id; /* -1: none yet */
    exact_point corners[3];
    const double *piece[3]; /* weights of a piece's corners in the source triangle, or NULL */
    double inv_w[3];
} weighed_exact;

/* Whether a sample lies in a triangle of either turn. */
static int holds(const exact_point *p, exact_point sample)
{
    tl_exact_counts counts = {0, 0, 0, 0, 0, 0};
    const int sign = edge_sign(p[0], p[1], p[2], &counts);
    const exact_point turned[3] = {p[0], p[sign < 0 ? 2 : 1], p[sign < 0 ? 1 : 2]};
    return sign && is_inside(turned, sample, TL_TEST_SAMPLE, &counts);
}

/* First piece of a triangle, by bisection in the ascending sources. */
static int64_t first_exact_piece(const tl_exact_pieces *p, int64_t id)
{
    int64_t low = 0, high = p ? p->n_pieces : 0;
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (p->source[middle] < id)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Makes `t` describe the triangle or piece that shows at the sample; 0 when the buffer does not belong to the mesh. */
static int find_weighed(weighed_exact *t, const tl_snapped *mesh, const tl_exact_points *points,
                        const tl_exact_pieces *pieces, int64_t id, exact_point sample)
{
    if (id >= 0 && id == t->id && !t->piece[0])
        return 1;
    t->id = -1, t->piece[0] = NULL;
    if (id < 0 || id >= mesh->n_triangles)
        return 0;
    const int32_t *corners = mesh->triangles + 3 * id;
    int is_cut = 0;
    for (int k = 0; k < 3; k++) {
        if (corners[k] < 0 || corners[k] >= points->n_points) /* the caller's array may have changed */
            return 0;
        t->corners[k] = point_of(points, corners[k]);
        t->inv_w[k] = inverse_w(&mesh->mesh, corners[k]);
        is_cut |= isnan(t->corners[k].x);
    }
    if (!is_cut) {
        t->id = id;
        return 1;
    }
    for (int64_t i = first_exact_piece(pieces, id); pieces && i < pieces->n_pieces && pieces->source[i] == id; i++) {
        for (int k = 0; k < 3; k++)
            t->corners[k] = piece_point(pieces, pieces->triangles[3 * i + k]);
        if (!holds(t->corners, sample))
            continue;
        for (int k = 0; k < 3; k++) {
            t->piece[k] = pieces->weights + 3 * (int64_t)pieces->triangles[3 * i + k];
            t->inv_w[k] = pieces->inv_w[pieces->triangles[3 * i + k]];
        }
        t->id = id;
        return 1;
    }
    return 0;
}

/* The edge functions opposite the corners, all by one power of two, which makes them numbers near 1. */
static void scaled_edges(const exact_point *corners, exact_point s, double *e)
{
    scaled_number found[3];
    int exponents[3], most = INT32_MIN;
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        const exact_point a = corners[next], b = corners[3 - k - next];
        double bound;
        found[k] = (scaled_number){rounded_edge(a, b, s, &bound), 0};
        if (!(fabs(found[k].mantissa) * 0x1p-32 > bound))
            found[k] = edge_value(a, b, s);
        int exponent;
        found[k].mantissa = frexp(found[k].mantissa, &exponent);
        exponents[k] = found[k].exponent + exponent;
        most = found[k].mantissa != 0.0 && exponents[k] > most ? exponents[k] : most;
    }
    for (int k = 0; k < 3; k++)
        e[k] = found[k].mantissa == 0.0 ? 0.0 : ldexp(found[k].mantissa, exponents[k] - most);
}

/* Perspective-correct weights of the input triangle's corners at a sample. */
static void weights_of_sample(const weighed_exact *t, exact_point s, double *weights)
{
    double part[3], sum = 0.0;
    scaled_edges(t->corners, s, part);
    for (int k = 0; k < 3; k++) {
        part[k] *= t->inv_w[k];
        sum += part[k];
    }
    for (int k = 0; k < 3; k++)
        weights[k] = t->piece[0] ? 0.0 : part[k] / sum;
    for (int k = 0; t->piece[0] && k < 3; k++)
        for (int j = 0; j < 3; j++)
            weights[j] += part[k] / sum * t->piece[k][j];
}

static void weigh_exact(const tl_snapped *mesh, const tl_exact_points *points, const tl_exact_pieces *pieces,
                        const tl_window *window, const int32_t *ids, const float *values, int n_values, int per_corner,
                        float background, float *restrict out)
{
    weighed_exact t = {.id = -1};
    for (int64_t row = 0; row < window->height; row++)
        for (int64_t col = 0; col < window->width; col++, ids++, out += n_values) {
            const exact_point sample = {(double)(col + window->x_px) + 0.5 + points->sample_x_px,
                                        (double)(row + window->y_px) + 0.5 + points->sample_y_px};
            double w[3];
            if (!find_weighed(&t, mesh, points, pieces, *ids, sample)) {
                for (int c = 0; c < n_values; c++)
                    out[c] = values ? background : 0.0f;
                continue;
            }
            weights_of_sample(&t, sample, w);
            for (int c = 0; c < n_values; c++) {
                double total = 0.0;
                for (int k = 0; values && k < 3; k++) {
                    const int64_t at = per_corner ? 3 * (int64_t)*ids + k : mesh->triangles[3 * (int64_t)*ids + k];
                    total += w[k] * (double)values[at * n_values + c];
                }
                out[c] = (float)(values ? total : w[c]);
            }
        }
}

#endif
