/* Nearest: the point of a surface that is nearest to a point, by a tree of boxes over triangles sorted so that
 * neighbours are together.
 * In: points and triangles.  Out: the tree; the nearest triangle of each point, and the nearest point of it.
 *
 * The result lies on its triangle whatever the tree does, so the distance to it is never too small.
 *
 * Based on: N. Roussopoulos, S. Kelley, F. Vincent, Nearest Neighbor Queries, 1995 (boxes in the order of their
 * distance); C. Ericson, Real-Time Collision Detection, 2005 (the point of a segment nearest to a point). */
#ifndef TL_NEAREST_C
#define TL_NEAREST_C

#include <float.h>
#include <math.h>
#include <stdint.h>

#include "lanes/lanes.h"
#include "mesh/nearest.h"

/* The nearest point of the surface to a point. */
typedef struct {
    double at[3];
    double squared; /* distance */
    int64_t triangle;
} foot;

TL_INLINE double dot_f64(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

TL_INLINE double squared_between(const double a[3], const double b[3])
{
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

TL_INLINE double clamp01(double x) { return x > 0.0 ? (x < 1.0 ? x : 1.0) : 0.0; }

/* The point of the segment that is nearest to p. */
TL_INLINE double nearest_of_segment(const double p[3], const double a[3], const double b[3], double at[3])
{
    const double ab[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, ap[3] = {p[0] - a[0], p[1] - a[1], p[2] - a[2]};
    const double length = dot_f64(ab, ab), t = length > 0.0 ? clamp01(dot_f64(ap, ab) / length) : 0.0;
    for (int k = 0; k < 3; k++)
        at[k] = a[k] + t * ab[k];
    return squared_between(p, at);
}

/* The projection of p onto the triangle, and its squared distance; infinity where it is outside. */
TL_INLINE double above_inside(const double p[3], const double a[3], const double b[3], const double c[3], double at[3])
{
    const double ab[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, ac[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    const double ap[3] = {p[0] - a[0], p[1] - a[1], p[2] - a[2]};
    const double bb = dot_f64(ab, ab), bc = dot_f64(ab, ac), cc = dot_f64(ac, ac), pb = dot_f64(ap, ab);
    const double pc = dot_f64(ap, ac);
    const double area = bb * cc - bc * bc, v = cc * pb - bc * pc, w = bb * pc - bc * pb;
    if (!(area > 1e-12 * bb * cc && v > 0.0 && w > 0.0 && v + w < area))
        return INFINITY;
    const double s = v / area, t = w / area;
    for (int k = 0; k < 3; k++)
        at[k] = a[k] + s * ab[k] + t * ac[k];
    return squared_between(p, at);
}

/* The point of the triangle that is nearest to p: its projection, or on a side.  For a needle whose inside is lost in
 * rounding, on a side. */
static double nearest_of_triangle(const double p[3], const double a[3], const double b[3], const double c[3],
                                  double at[3])
{
    const double inside = above_inside(p, a, b, c, at);
    if (inside < INFINITY)
        return inside;
    double other[3], best = nearest_of_segment(p, a, b, at);
    for (int side = 0; side < 2; side++) {
        const double squared = nearest_of_segment(p, side ? c : b, side ? a : c, other);
        if (squared < best) {
            best = squared;
            at[0] = other[0], at[1] = other[1], at[2] = other[2];
        }
    }
    return best;
}

TL_INLINE const double *corner_of(const tl_surface *s, int64_t triangle, int k)
{
    return s->points + 3 * (int64_t)s->triangles[3 * triangle + k];
}

/* Sets the foot of p on one triangle. */
static void set_foot(const tl_surface *s, const double p[3], int64_t triangle, foot *out)
{
    out->triangle = triangle;
    out->squared = nearest_of_triangle(p, corner_of(s, triangle, 0), corner_of(s, triangle, 1),
                                       corner_of(s, triangle, 2), out->at);
}

/* Lower bounds of the squared distances of p from the boxes of a node: a sum and its parts are rounded 8 times. */
TL_INLINE void box_distances(const tl_tree_node *node, const float p[3], float out[TL_TREE_WIDTH])
{
    for (int k = 0; k < TL_TREE_WIDTH; k++) {
        float sum = 0.0f;
        for (int axis = 0; axis < 3; axis++) {
            const float below = node->ends[axis][k] - p[axis], above = p[axis] - node->ends[3 + axis][k];
            const float outside = below > above ? below : above;
            const float gap = outside > 0.0f ? outside : 0.0f;
            sum += gap * gap;
        }
        out[k] = sum < FLT_MAX ? sum * (1.0f - 16.0f * FLT_EPSILON) : FLT_MAX;
    }
}

/* Improves a foot of p to the nearest of all triangles, the first of those equally near.  So the result does not depend
 * on the start, which is the triangle of the point before. */
static void improve_foot(const tl_surface *s, const double p[3], foot *best)
{
    struct {
        int64_t node;
        int level;
        float squared;
    } stack[TL_TREE_LEVELS * TL_TREE_WIDTH];
    const float p32[3] = {(float)p[0], (float)p[1], (float)p[2]};
    int n = 0;
    stack[n].node = 0, stack[n].level = s->n_levels - 1, stack[n++].squared = 0.0f;
    while (n) {
        n--;
        const int64_t node = stack[n].node;
        const int level = stack[n].level;
        if ((double)stack[n].squared > best->squared)
            continue;
        float squared[TL_TREE_WIDTH];
        box_distances(s->nodes + s->first_node[level] + node, p32, squared);
        const int64_t first = node * TL_TREE_WIDTH;
        const int base = n;
        for (int k = 0; k < TL_TREE_WIDTH; k++) {
            if (!((double)squared[k] <= best->squared))
                continue;
            if (level == 0) {
                const int64_t begin = (first + k) * TL_TREE_LEAF, end = begin + TL_TREE_LEAF;
                for (int64_t i = begin; i < end && i < s->n_triangles; i++) {
                    foot other;
                    set_foot(s, p, i, &other);
                    if (other.squared < best->squared || (other.squared == best->squared && i < best->triangle))
                        *best = other;
                }
                continue;
            }
            int at = n++; /* the nearest on top */
            for (; at > base && stack[at - 1].squared < squared[k]; at--)
                stack[at] = stack[at - 1];
            stack[at].node = first + k, stack[at].level = level - 1, stack[at].squared = squared[k];
        }
    }
}

/* The box of a triangle, wider by the slack. */
static void box_of_triangle(const tl_surface *s, int64_t triangle, float box[TL_TREE_BOX])
{
    for (int axis = 0; axis < 3; axis++) {
        double low = INFINITY, high = -INFINITY;
        for (int k = 0; k < 3; k++) {
            const double x = corner_of(s, triangle, k)[axis];
            low = x < low ? x : low, high = x > high ? x : high;
        }
        box[axis] = (float)low - s->slack, box[3 + axis] = (float)high + s->slack;
    }
}

/* The box of all boxes of a node. */
static void box_of_node(const tl_tree_node *node, float box[TL_TREE_BOX])
{
    for (int axis = 0; axis < 3; axis++) {
        float low = INFINITY, high = -INFINITY;
        for (int k = 0; k < TL_TREE_WIDTH; k++) {
            low = node->ends[axis][k] < low ? node->ends[axis][k] : low;
            high = node->ends[3 + axis][k] > high ? node->ends[3 + axis][k] : high;
        }
        box[axis] = low, box[3 + axis] = high;
    }
}

static void join_box(float box[TL_TREE_BOX], const float other[TL_TREE_BOX])
{
    for (int axis = 0; axis < 3; axis++) {
        box[axis] = other[axis] < box[axis] ? other[axis] : box[axis];
        box[3 + axis] = other[3 + axis] > box[3 + axis] ? other[3 + axis] : box[3 + axis];
    }
}

static void build_tree(tl_surface *s)
{
    for (int level = 0; level < s->n_levels; level++) {
        for (int64_t i = 0; i < s->n_nodes[level]; i++) {
            tl_tree_node *node = s->nodes + s->first_node[level] + i;
            for (int k = 0; k < TL_TREE_WIDTH; k++) {
                const int64_t child = i * TL_TREE_WIDTH + k;
                float box[TL_TREE_BOX] = {INFINITY, INFINITY, INFINITY, -INFINITY, -INFINITY, -INFINITY},
                      own[TL_TREE_BOX];
                for (int64_t t = child * TL_TREE_LEAF;
                     level == 0 && t < (child + 1) * TL_TREE_LEAF && t < s->n_triangles; t++) {
                    box_of_triangle(s, t, own);
                    join_box(box, own);
                }
                if (level > 0 && child < s->n_nodes[level - 1])
                    box_of_node(s->nodes + s->first_node[level - 1] + child, box);
                for (int end = 0; end < TL_TREE_BOX; end++)
                    node->ends[end][k] = box[end];
            }
        }
    }
}

static void set_feet(const double *points, const int32_t *triangles, const double *from, const int32_t *triangle,
                     const int32_t *point, int64_t n, double *at, double *squared)
{
    for (int64_t i = 0; i < n; i++) {
        const int32_t *corner = triangles + 3 * (int64_t)triangle[i];
        squared[i] = nearest_of_triangle(from + 3 * (int64_t)point[i], points + 3 * (int64_t)corner[0],
                                         points + 3 * (int64_t)corner[1], points + 3 * (int64_t)corner[2], at + 3 * i);
    }
}

static double nearest_of_points(const tl_surface *s, const double *points, int64_t first, int64_t end,
                                int32_t *triangle, double *at)
{
    double largest = 0.0;
    int64_t seed = 0;
    for (int64_t i = first; i < end; i++) {
        foot best;
        set_foot(s, points + 3 * i, seed, &best);
        improve_foot(s, points + 3 * i, &best);
        seed = best.triangle;
        triangle[i] = (int32_t)seed;
        for (int k = 0; at && k < 3; k++)
            at[3 * i + k] = best.at[k];
        largest = best.squared > largest ? best.squared : largest;
    }
    return sqrt(largest);
}

#endif
