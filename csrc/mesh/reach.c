/* Reach: how far the points of triangles can lie from a surface, bounded from above, by branch and bound.
 * In: triangles and the surface.  Out: a distance that some point reaches, and a bound that no point exceeds.
 *
 * The distance from one triangle of the surface is a convex function, so over a convex piece of a triangle it is
 * largest at a corner, and the distance from the surface is not larger.  Also, no point of a piece is farther from the
 * surface than its middle by more than its radius.  Where neither bound is near enough to the known distance, the piece
 * is cut along the sides of the triangle that is nearest to its middle: that triangle bounds the part above it, other
 * triangles bound the rest.  Where that does not help, the piece is halved.  A bound holds wherever the cuts are, and
 * whichever triangle gives it: recent triangles are tried before the tree.
 *
 * Based on: M. Tang, M. Lee, Y. J. Kim, Interactive Hausdorff Distance Computation for General Polygonal Models, 2009;
 * M. Guthe, P. Borodin, R. Klein, Fast and Accurate Hausdorff Distance Calculation between Meshes, 2005 (branch and
 * bound, and that the distance is convex). */
#ifndef TL_REACH_C
#define TL_REACH_C

#include <math.h>
#include <stdint.h>

#include "lanes/lanes.h"
#include "mesh/nearest.c"
#include "mesh/nearest.h"

enum {
    TL_PIECE_CORNERS = 12,
    TL_PIECES = 96, /* on the stack; without room a piece is bounded without a cut */
    TL_RECENT = 8,  /* recent triangles: blob of 10^6 and its 250,000, 6.1 s of CPU time to 4.4 */
};

/* A convex piece of a triangle. */
typedef struct {
    int n;
    double corner[TL_PIECE_CORNERS][3];
} convex;

/* Constants of all pieces of a triangle. */
typedef struct {
    const tl_surface *surface;
    double across[3]; /* the normal of the triangle, of any length */
    double share, least;
    double known;
    int64_t recent[TL_RECENT]; /* triangles that gave bounds, the latest first: neighbours are near them, too */
} reaching;

static void cross_f64(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static void add_corner(convex *p, const double at[3])
{
    for (int k = 0; k < 3; k++)
        p->corner[p->n][k] = at[k];
    p->n++;
}

/* Cuts a piece by the plane through `at`, into the part in the direction of `normal` and the rest.  Returns 0 and cuts
 * nothing where either part would be thinner than `slack`.  There must be room for two corners more. */
static int cut(const convex *p, const double at[3], const double normal[3], double slack, convex *inside,
               convex *outside)
{
    double height[TL_PIECE_CORNERS], lowest = 0.0, highest = 0.0;
    for (int i = 0; i < p->n; i++) {
        const double from[3] = {p->corner[i][0] - at[0], p->corner[i][1] - at[1], p->corner[i][2] - at[2]};
        height[i] = dot_f64(from, normal);
        lowest = height[i] < lowest ? height[i] : lowest;
        highest = height[i] > highest ? height[i] : highest;
    }
    inside->n = outside->n = 0;
    if (lowest >= -slack || highest <= slack)
        return 0;
    for (int i = 0; i < p->n; i++) {
        const int j = i + 1 < p->n ? i + 1 : 0;
        if (height[i] >= 0.0)
            add_corner(inside, p->corner[i]);
        if (height[i] <= 0.0)
            add_corner(outside, p->corner[i]);
        if ((height[i] > 0.0 && height[j] < 0.0) || (height[i] < 0.0 && height[j] > 0.0)) {
            const double t = height[i] / (height[i] - height[j]);
            double middle[3];
            for (int k = 0; k < 3; k++)
                middle[k] = p->corner[i][k] + t * (p->corner[j][k] - p->corner[i][k]);
            add_corner(inside, middle);
            add_corner(outside, middle);
        }
    }
    return 1;
}

/* The largest squared distance of a piece's corners from a triangle; sets *farthest to that corner. */
static double squared_from_triangle(const tl_surface *s, const convex *p, int64_t triangle, int *farthest)
{
    double largest = 0.0, at[3];
    *farthest = 0;
    for (int i = 0; i < p->n; i++) {
        const double squared = nearest_of_triangle(p->corner[i], corner_of(s, triangle, 0), corner_of(s, triangle, 1),
                                                   corner_of(s, triangle, 2), at);
        if (squared > largest)
            largest = squared, *farthest = i;
    }
    return largest;
}

/* Moves a triangle to the front of the recent triangles, in place of the one at [i]. */
TL_INLINE void remember(reaching *r, int64_t triangle, int i)
{
    for (; i > 0; i--)
        r->recent[i] = r->recent[i - 1];
    r->recent[0] = triangle;
}

/* The foot of a point; its distance is reached. */
static foot foot_of(reaching *r, const double p[3])
{
    foot best;
    set_foot(r->surface, p, r->recent[0], &best);
    improve_foot(r->surface, p, &best);
    const double distance = sqrt(best.squared);
    r->known = distance > r->known ? distance : r->known;
    int i = 0;
    while (i < TL_RECENT - 1 && r->recent[i] != best.triangle)
        i++;
    remember(r, best.triangle, i);
    return best;
}

/* The largest bound that is near enough. */
static double enough_of(const reaching *r)
{
    const double more = r->share * r->known;
    return r->known + (more > r->least ? more : r->least);
}

/* The foot of the middle of a piece: on a recent triangle, if the middle projects inside it and is not farther than the
 * known distance; else on the nearest triangle. */
static foot foot_of_middle(reaching *r, const double middle[3])
{
    const tl_surface *s = r->surface;
    for (int i = 0; i < TL_RECENT; i++) {
        foot below = {.triangle = r->recent[i]};
        below.squared = above_inside(middle, corner_of(s, below.triangle, 0), corner_of(s, below.triangle, 1),
                                     corner_of(s, below.triangle, 2), below.at);
        if (below.squared <= r->known * r->known) {
            remember(r, below.triangle, i);
            return below;
        }
    }
    return foot_of(r, middle);
}

/* Cuts a piece along the sides of a triangle, perpendicular to the piece's triangle; pushes the parts outside.  Returns
 * how many. */
static int cut_along(const reaching *r, convex *p, int64_t triangle, double slack, convex *rest)
{
    int n = 0;
    for (int k = 0; k < 3; k++) {
        const double *a = corner_of(r->surface, triangle, k), *b = corner_of(r->surface, triangle, k == 2 ? 0 : k + 1);
        const double *c = corner_of(r->surface, triangle, k == 0 ? 2 : k - 1);
        const double side[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        const double third[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
        double normal[3];
        cross_f64(side, r->across, normal);
        const double length = sqrt(dot_f64(normal, normal)), towards = dot_f64(normal, third);
        if (!(length > 0.0) || towards == 0.0 || p->n + 2 > TL_PIECE_CORNERS)
            continue;
        for (int axis = 0; axis < 3; axis++)
            normal[axis] *= (towards < 0.0 ? -1.0 : 1.0) / length;
        convex inside;
        if (!cut(p, a, normal, slack, &inside, rest + n))
            continue;
        *p = inside;
        n++;
    }
    return n;
}

/* Halves a piece across its longest radius; a piece with many corners by a diagonal.  The second half is stored after
 * the first. */
static void halve(convex *p, const double middle[3])
{
    const convex whole = *p;
    convex *other = p + 1;
    if (whole.n + 2 > TL_PIECE_CORNERS) {
        const int half = whole.n / 2;
        p->n = other->n = 0;
        for (int i = 0; i <= half; i++)
            add_corner(p, whole.corner[i]);
        for (int i = half; i <= whole.n; i++)
            add_corner(other, whole.corner[i < whole.n ? i : 0]);
        return;
    }
    double longest = -1.0, along[3] = {0.0, 0.0, 0.0};
    for (int i = 0; i < whole.n; i++) {
        const double squared = squared_between(whole.corner[i], middle);
        for (int k = 0; squared > longest && k < 3; k++)
            along[k] = whole.corner[i][k] - middle[k];
        longest = squared > longest ? squared : longest;
    }
    cut(&whole, middle, along, 0.0, p, other);
}

/* Sets the middle of a piece; returns its squared radius around it. */
static double middle_of(const convex *p, double middle[3])
{
    double largest = 0.0;
    for (int k = 0; k < 3; k++) {
        middle[k] = 0.0;
        for (int i = 0; i < p->n; i++)
            middle[k] += p->corner[i][k];
        middle[k] /= p->n;
    }
    for (int i = 0; i < p->n; i++) {
        const double squared = squared_between(p->corner[i], middle);
        largest = squared > largest ? squared : largest;
    }
    return largest;
}

/* Bounds a piece, by the cheapest means that suffices; else leaves a part of it on top of the stack, and the rest
 * below. */
static double bound_piece(reaching *r, convex *stack, int *n)
{
    convex *p = stack + *n - 1;
    --*n;
    double middle[3];
    const double radius = sqrt(middle_of(p, middle));
    const foot below = foot_of_middle(r, middle);
    const double by_middle = sqrt(below.squared) + radius;
    if (by_middle <= enough_of(r))
        return by_middle;
    int farthest;
    double by_triangle = sqrt(squared_from_triangle(r->surface, p, below.triangle, &farthest));
    if (by_triangle <= enough_of(r))
        return by_triangle;
    if (*n + 5 > TL_PIECES)
        return by_triangle < by_middle ? by_triangle : by_middle;
    convex rest[3];
    const int n_rest = cut_along(r, p, below.triangle, 0.125 * (enough_of(r) - r->known), rest);
    convex own = *p;
    for (int i = 0; i < n_rest; i++)
        stack[(*n)++] = rest[i];
    by_triangle = sqrt(squared_from_triangle(r->surface, &own, below.triangle, &farthest));
    if (by_triangle > enough_of(r))
        (void)foot_of(r, own.corner[farthest]);
    if (by_triangle <= enough_of(r))
        return by_triangle;
    (void)middle_of(&own, middle);
    stack[*n] = own;
    halve(stack + *n, middle);
    *n += 2;
    return 0.0;
}

/* Each triangle starts from `reach->known`, so that the result does not depend on the range. */
static void find_reach(const tl_surface *s, const double *points, const int32_t *triangles, int64_t first, int64_t end,
                       double share, double least, tl_reach *reach)
{
    convex stack[TL_PIECES];
    reaching r = {s, {0.0, 0.0, 0.0}, share, least, 0.0, {0}};
    const double known = reach->known;
    for (int64_t i = first; i < end; i++) {
        int n = 1;
        int64_t n_pieces = 0;
        stack[0].n = 0;
        for (int k = 0; k < 3; k++)
            add_corner(stack, points + 3 * (int64_t)triangles[3 * i + k]);
        double ab[3], ac[3];
        for (int k = 0; k < 3; k++)
            ab[k] = stack[0].corner[1][k] - stack[0].corner[0][k],
            ac[k] = stack[0].corner[2][k] - stack[0].corner[0][k];
        cross_f64(ab, ac, r.across);
        r.known = known;
        while (n) {
            const double bound = bound_piece(&r, stack, &n);
            reach->bound = bound > reach->bound ? bound : reach->bound;
            n_pieces++;
        }
        reach->n_pieces = n_pieces > reach->n_pieces ? n_pieces : reach->n_pieces;
        reach->known = r.known > reach->known ? r.known : reach->known;
    }
}

#endif
