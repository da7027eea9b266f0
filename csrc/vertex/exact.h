/* The contract of exact drawing: vertices that are not snapped. */
#ifndef TOPLEFT_EXACT_H
#define TOPLEFT_EXACT_H

#include <stdint.h>

/* A transformed vertex: x, y, depth, and its place: x and y as int32, rounded to 2^-18 px and clamped to 2^12 px. */
#define TL_PLACED 4
#define TL_PLACE_BITS 18
#define TL_PLACE_LIMIT_PX 4096

/* A mesh with these float64 vertices.  A vertex that cannot be drawn has x NaN.  `triangles` are those of the mesh,
 * collapsed to a point where a clip plane cuts them, and then all pieces. */
typedef struct tl_exact_points {
    const double
        *points; /* (n_points, stride): x and y in pixels, and depth when stride > 2; then the vertices of pieces */
    int stride;  /* 2, 3 or TL_PLACED */
    int64_t n_points;
    const int32_t *triangles; /* (n_triangles, 3) */
    int64_t n_triangles;
    const int32_t *names;           /* (n_triangles,) the triangle of the mesh of each; NULL: its index */
    const struct tl_pieces *pieces; /* or NULL */
    double band;                    /* 1; tests pass less, and must get wrong pixels */
} tl_exact_points;

#endif
