/* The contract of shading: what a surface is made of, what lights it, and where it is seen from.
 * Colours are linear light, 1 is white.  Vectors are those of one space, the shading space, whose origin is near the
 * mesh. */
#ifndef TOPLEFT_SHADING_H
#define TOPLEFT_SHADING_H

#include <stdint.h>

#define TL_MAX_LEVELS 16

typedef enum { TL_FILTER_NEAREST = 0, TL_FILTER_BILINEAR = 1, TL_FILTER_TRILINEAR = 2 } tl_filter;
typedef enum { TL_WRAP_REPEAT = 0, TL_WRAP_CLAMP = 1, TL_WRAP_MIRROR = 2 } tl_wrap;

/* A picture and its halves.  A texel is four uint16, red, green, blue and alpha, in 65535ths; row 0 is v = 0.  Behind
 * each row stands its first texel again, so that two neighbours are one load. */
typedef struct {
    const uint16_t *texels;
    int32_t offset[TL_MAX_LEVELS]; /* of each level, in texels */
    int32_t width[TL_MAX_LEVELS], height[TL_MAX_LEVELS];
    int n_levels;
    tl_filter filter;
    tl_wrap wrap_u, wrap_v;
} tl_texture;

typedef struct {
    float color[4];      /* times the texture and the colours of the vertices; the fourth is opacity, for the cut-out */
    float back_color[3]; /* instead of `color` and all that where the back is seen */
    float back_side;     /* sign of the area there: -1, in a mirror 1; 0: the back has no colour of its own */
    float specular[3];
    float shininess; /* Blinn's exponent; 0: no highlight */
    int is_unlit;
    float cutoff;              /* samples with less opacity are left out by draw_cutout; 0: none */
    const tl_texture *texture; /* or NULL */
} tl_material;

typedef enum { TL_LIGHT_DIRECTION = 0, TL_LIGHT_POINT = 1, TL_LIGHT_WRAPPED = 2 } tl_light_kind;

typedef struct {
    tl_light_kind kind;
    float at[3]; /* the unit vector to the light, or where it is */
    float color[3];
    float falloff; /* of a point at distance d: the light is divided by 1 + falloff * d^2 */
} tl_light;

/* What the colours of the picture tell. */
typedef enum { TL_SHOW_LIGHT = 0, TL_SHOW_NORMALS = 1, TL_SHOW_MATCAP = 2 } tl_show;

typedef struct {
    const float *normals; /* rows of four: the unit normal, or 0, and 1/w; of the vertices, then of creases */
    /* (n_triangles, 3): the row that each corner has; NULL: that of its vertex */
    const int32_t *normal_of_corner;
    /* (n_triangles, 4): unit, on the side that is counter-clockwise; NULL: interpolated ones */
    const float *face_normals;
    const void *positions; /* (n_vertices, 3) float32 or float64: the face normal where interpolated ones cancel */
    int is_f64;
    /* (n_triangles,): the normals of its vertices point to the other side; NULL: those of none do */
    const uint8_t *is_turned;
    const float *uv;            /* (n_vertices, 2), or NULL */
    const float *colors;        /* (n_vertices, 4): sRGB, 0 to 255, or NULL */
    const int32_t *material_of; /* (n_triangles,), or NULL: all have the first */
    const tl_material *materials;
    int n_materials;
    const tl_light *lights;
    int n_lights;
    float ambient[3];
    tl_show show;
    const tl_texture *matcap; /* MATCAP */
    float eye_from[3][4];     /* the rows of the rotation to eye space; the fourth number is not read */
    /* Where the pixel (x, y) of the picture looks: from `eye` along ray[0] + x ray[1] + y ray[2], 1/w of which is the
     * point that is seen.  Without perspective the ray starts at that point instead, and ends at `depth` times
     * ray[3]. */
    int has_perspective;
    float eye[3], ray[4][3];
    /* The depth cue: a share (distance - near) * fog_scale of the light, 0 to 1, gives way to fog_color; fog_scale 0:
     * none.  The distance is w times distance_scale, or distance_start + depth * distance_scale without perspective. */
    float fog_color[3], fog_near, fog_scale, distance_start, distance_scale;
    const float *decode; /* (256,): the light of an sRGB value */
    float background[4]; /* linear light and opacity */
    uint8_t background_bytes[4];
} tl_shading;

#endif
