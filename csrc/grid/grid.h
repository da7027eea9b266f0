/* The contract of csrc/grid: a mesh on the texels of its texture coordinates. */
#ifndef TOPLEFT_GRID_H
#define TOPLEFT_GRID_H

#include <stdint.h>

typedef struct {
    const double *points;     /* (V, 2): in texels, y down */
    const int32_t *triangles; /* (T, 3), checked */
    int64_t n_points, n_triangles;
    int64_t width;
    const float *values; /* (V, n_values), or per corner (T, 3, n_values) */
    int n_values, per_corner;
} tl_atlas;

#define TL_NO_TEXEL 16384 /* more than any reach of a gutter */
#define TL_MOST_CHANNELS 4

/* A photo: a camera picture of a mesh, with its buffers. */
typedef struct {
    int64_t width, height;
    const int32_t *ids; /* -1 for none */
    const float *depth; /* window depth, 0 near to 1 far */
    const float *light; /* (height, width, n_channels), linear */
    int n_channels;     /* at most TL_MOST_CHANNELS */
    int keeps_best;     /* the light with the largest weight, instead of the mean */
    double clip_from_object[16];
    double eye[4]; /* homogeneous: a position, or with eye[3] = 0 a direction */
} tl_taken;

#endif
