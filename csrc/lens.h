/* The contract of lenses: how one bends directions, and the triangles of its picture.  Part of the contract
 * of topleft.h, which includes it.
 *
 * Axes are those of OpenCV: x right, y down, z along the view; the image plane lies at z = 1.  "Eye space" has y up and
 * looks along -z. */
#ifndef TOPLEFT_LENS_H
#define TOPLEFT_LENS_H

#include <stdint.h>

#define TL_LENS_RINGS 16

/* Edges of a larger angle, as the lens sees them, are halved in any case: so every triangle is small enough on the
 * sphere of directions for the test whether the picture cannot show it.  cos(0.25). */
#define TL_LEAST_EDGE_COSINE 0x1.f01549f7deea1p-1

/* Relative error of the distance that a fisheye has for depth: longer edges are halved, too. */
#define TL_MAX_RANGE_ERROR 0x1p-12

/* An edge that stays so near to its middle in the picture is not halved for its bend: no pixel would tell. */
#define TL_SHORT_PX 0.5

/* No edge is halved more often; only one that passes through the lens would be. */
#define TL_MAX_HALVINGS 24

/* A lens, and the picture behind it, which goes on outwards evenly from the angle `limit` on. */
typedef struct {
    int is_fisheye;
    double k[6];       /* of OpenCV k1 to k6, of a fisheye k1 to k4 */
    double p[2], s[4]; /* tangential terms and the prism's, of OpenCV */
    double tilt[4];    /* cosine and sine of tau_x, then of tau_y */
    int has_prism, is_tilted;
    double limit, limit_cosine, limit_sine;
    double slope;                /* of the distance from the middle of the image plane to the angle, beyond the limit */
    double least_cosine;         /* no range is less than so much of the distance */
    double cap_cosine, cap_sine; /* of the angle from the axis beyond which nothing shows */
    double px_from_plane[6];     /* two rows: pixels from the middle of the picture, y up */
    double tolerance_px, near;
    /* the squared chord from the axis up to which the rings go, negative: there are none; and 256 over it */
    float plain_chord, ring_scale;
    float allowed[TL_LENS_RINGS]; /* the squared chord of directions below which no edge is bent, by ring */
} tl_lens;

/* The parts of triangles that a lens splits.  Without `triangles` they are counted only. */
typedef struct {
    int64_t n_parts, n_points; /* in and out: those before */
    int64_t most;              /* no more parts are made than just above these */
    int32_t first_point;       /* the index of the first of the points */
    int32_t *triangles;        /* (n_parts, 3): vertices of the mesh, or points */
    int32_t *source;           /* (n_parts,): the triangle each is a part of */
    double *weights;           /* (n_parts, 3, 3): each corner as a mean of the corners of that triangle */
    uint8_t *is_outline;       /* (n_parts, 3): which sides (0-1, 1-2, 2-0) lie on a side of that triangle */
    double *points;            /* (n_points, 3), eye space, bent */
} tl_bent_parts;

#endif
