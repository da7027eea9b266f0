/* The contract of lenses: how a lens bends directions, and the triangles of its picture.
 *
 * Axes are those of OpenCV: x right, y down, z along the view; the image plane lies at z = 1.  "Eye space" has y up and
 * looks along -z. */
#ifndef TOPLEFT_LENS_H
#define TOPLEFT_LENS_H

#include <stdint.h>

#define TL_LENS_RINGS 16

/* Edges of a larger angle, as the lens shows them, are always halved: so every triangle is small enough on the sphere
 * of directions to be tested against the picture.  cos(0.25). */
#define TL_LEAST_EDGE_COSINE 0x1.f01549f7deea1p-1

/* Relative error of the distance that a fisheye uses as depth: edges with more are halved, too. */
#define TL_MAX_RANGE_ERROR 0x1p-12

/* An edge whose picture is that short is not halved for its bend: no pixel would show it. */
#define TL_SHORT_PX 0.5

/* No edge is halved more often; only an edge through the lens would be. */
#define TL_MAX_HALVINGS 24

/* A lens, and its picture, which is extrapolated evenly beyond the angle `limit`. */
typedef struct {
    int is_fisheye;
    double k[6];       /* OpenCV's k1 to k6; for a fisheye k1 to k4 */
    double p[2], s[4]; /* OpenCV's tangential and prism terms */
    double tilt[4];    /* cosine and sine of tau_x, then of tau_y */
    int has_prism, is_tilted;
    double limit, limit_cosine, limit_sine;
    double slope;                /* d (distance from the middle of the image plane) / d angle, beyond the limit */
    double least_cosine;         /* the range is at least so much of the distance */
    double cap_cosine, cap_sine; /* of the angle from the axis beyond which nothing is visible */
    double px_from_plane[6];     /* two rows: pixels from the middle of the picture, y up */
    double tolerance_px, near;
    /* the squared chord from the axis up to which the rings go, negative: no rings; and 256 over it */
    float plain_chord, ring_scale;
    float allowed[TL_LENS_RINGS]; /* by ring: the squared chord below which edges are straight */
} tl_lens;

/* The parts of triangles that a lens splits.  With `triangles` NULL they are only counted. */
typedef struct {
    int64_t n_parts, n_points; /* in and out: number so far */
    int64_t most;              /* a limit of n_parts, which the last triangle may exceed */
    int32_t first_point;       /* the index of points[0] */
    int32_t *triangles;        /* (n_parts, 3): vertices of the mesh, or points */
    int32_t *source;           /* (n_parts,): the triangle each is a part of */
    double *weights;           /* (n_parts, 3, 3): the weights of the triangle's corners at each corner */
    uint8_t *is_outline;       /* (n_parts, 3): which sides (0-1, 1-2, 2-0) lie on a side of the triangle */
    double *points;            /* (n_points, 3), eye space, bent */
} tl_bent_parts;

#endif
