/* The contract of shading: the material of a surface, its lights, and the eye. Colours are linear light, 1 is white.
 * All vectors are in one space, the shading space, with its origin near the mesh. */
#ifndef TOPLEFT_SHADING_H
#define TOPLEFT_SHADING_H

#include <stdint.h>

#include "topleft.h"

#define TL_MAX_LEVELS 16

/* TL_FILTER_PIXELATED: TL_FILTER_NEAREST where texels are larger than a pixel, else TL_FILTER_TRILINEAR. */
typedef enum {
    TL_FILTER_NEAREST = 0,
    TL_FILTER_BILINEAR = 1,
    TL_FILTER_TRILINEAR = 2,
    TL_FILTER_PIXELATED = 3
} tl_filter;
typedef enum { TL_WRAP_REPEAT = 0, TL_WRAP_CLAMP = 1, TL_WRAP_MIRROR = 2 } tl_wrap;

/* A picture and its mipmap levels.  A texel is four uint16, red, green, blue and alpha, in 65535ths; row 0 is v = 0.
 * The first texel of each row is repeated after its last, so that two neighbours are one load. */
typedef struct {
    const uint16_t *texels;
    int32_t offset[TL_MAX_LEVELS]; /* of each level, in texels */
    int32_t width[TL_MAX_LEVELS], height[TL_MAX_LEVELS];
    int n_levels;
    tl_filter filter;
    tl_wrap wrap_u, wrap_v;
    int uv_set;            /* 0 or 1 */
    int has_transform;     /* from (u, v, 1) to texture coordinates: */
    float transform[2][3]; /* two rows; both 0 without a transform */
    float tangent[2];      /* the parts of the directions of u and of v in the direction of the transformed u */
    float hand;            /* -1 where the transform mirrors, else 1 */
} tl_texture;

/* A picture that becomes the texels of a tl_texture, row by row. */
typedef struct {
    const uint8_t *image;  /* (height, width, 4), row 0 at v = 1 */
    const double *light;   /* (2, 256): red, green or blue, and opacity, 0 to 1, of a byte */
    const int32_t *levels; /* n_levels rows: offset in texels, width, height */
    int n_levels;
    int64_t *n_written; /* (n_levels,): rows of each level; 0 before the first call */
    double *room;       /* 8 numbers for each texel of a row of each level */
    uint16_t *texels;
} tl_picture_levels;

/* An array of values and its mipmap levels, row 0 at v = 1. */
typedef struct {
    const float *texels;
    const int64_t *rows; /* of each level: its offset in texels, its width and height */
    int n_levels;        /* 1 unless `filter` is TL_FILTER_TRILINEAR or TL_FILTER_PIXELATED */
    int n_channels;
    tl_filter filter;
    tl_wrap wrap_u, wrap_v;
} tl_levels;

typedef struct {
    float color[4];      /* times the texture and the colours of the vertices; the fourth is opacity, for the cut-out */
    float back_color[3]; /* instead of `color`, texture and vertex colours on the back */
    float back_side;     /* sign of the area of the back: -1, in a mirror 1; 0: no colour of the back */
    float specular[3];
    float shininess; /* Blinn's exponent; 0: no highlight */
    int is_unlit;
    float cutoff;              /* samples with less opacity are discarded; 0: no cut-out */
    const tl_texture *texture; /* NULL, like all textures, if absent */
    /* What follows, and textures with a transform or of the second set, are read only if `is_full`. */
    int is_full;
    int is_metallic; /* glTF's metallic-rough surface, instead of the highlight */
    float metallic, roughness;
    float occlusion, normal_scale;        /* strength of each texture */
    float emission[3];                    /* light, >= 0 */
    const tl_texture *metallic_roughness; /* roughness in green, metallic in blue */
    const tl_texture *occlusion_map;      /* in red: the share of the surroundings' light that arrives */
    const tl_texture *normal_map;
    const tl_texture *emission_map;
} tl_material;

typedef enum { TL_SURROUNDINGS_SKY = 0, TL_SURROUNDINGS_IMAGE = 1 } tl_surroundings_kind;

/* Light from all directions, in a separate space, where up is y: a sky over a ground, or a picture of all directions,
 * an octahedron unfolded to a square.  Level k < n_levels - 1 is blurred for a surface of roughness k / (n_levels - 2),
 * level n_levels - 1 for a matt one.  A texel is four floats; each level has a border of one texel. */
typedef struct {
    tl_surroundings_kind kind;
    float from_shading[3][4]; /* rows; the fourth number is not read */
    float sky[3], ground[3];
    float diffuse; /* factor for matt surfaces: 0 if other light replaces it, else 1 */
    const float *texels;
    int32_t offset[TL_MAX_LEVELS], size[TL_MAX_LEVELS]; /* in texels; the size without the border */
    int n_levels;
} tl_surroundings;

typedef enum { TL_LIGHT_DIRECTION = 0, TL_LIGHT_POINT = 1, TL_LIGHT_WRAPPED = 2, TL_LIGHT_SPOT = 3 } tl_light_kind;

typedef struct {
    tl_light_kind kind;
    float at[3]; /* the unit vector to the light, or its position */
    float color[3];
    float falloff; /* of a point at distance d: the light is divided by 1 + falloff * d^2 */
    /* The light of a spot at the angle a from its unit axis is that of a point times (cone_scale * cos a +
     * cone_offset)^2, the sum clamped to 0 and 1. */
    float axis[3], cone_scale, cone_offset;
} tl_light;

/* The meaning of the picture's colours. */
typedef enum { TL_SHOW_LIGHT = 0, TL_SHOW_NORMALS = 1, TL_SHOW_MATCAP = 2 } tl_show;

typedef struct {
    const float *normals; /* rows of four: the unit normal, or 0, and 1/w; of the vertices */
    int finds_inverse_w;  /* compute 1/w of visible vertices from positions and the matrix instead */
    /* (n_triangles, 3): the row of `corner_normals` of each corner; NULL: corners have the normals of their vertices */
    const int32_t *normal_of_corner;
    const float *corner_normals; /* rows of four: the unit normal, or 0; the fourth is not read */
    /* (n_triangles, 4): unit, on the counter-clockwise side; NULL: normals are interpolated */
    const float *face_normals;
    const void *positions; /* (n_vertices, 3) float32 or float64: for the face normal where normals cancel */
    int is_f64;
    /* (n_triangles,): the normals of its vertices point to the clockwise side; NULL: no triangle's do */
    const uint8_t *is_turned;
    const float *uv;            /* (n_vertices, 2), or NULL */
    const float *uv1;           /* the second set */
    const float *colors;        /* (n_vertices, 4): sRGB, 0 to 255, and opacity, 0 to 1; or NULL */
    int has_alpha;              /* some colours are not opaque */
    float front_side;           /* sign of the area of the front: 1, in a mirror -1 */
    const int32_t *material_of; /* (n_triangles,), or NULL: all triangles have material 0 */
    const tl_material *materials;
    int n_materials;
    const tl_light *lights;
    int n_lights;
    float ambient[3];
    const tl_surroundings *surroundings; /* or NULL */
    int wants_opacity;                   /* the alpha of the picture is that of the surface; materials are then full */
    tl_show show;
    const tl_texture *matcap; /* MATCAP */
    float eye_from[3][4];     /* the rows of the rotation to eye space; the fourth number is not read */
    /* The ray of the pixel (x, y) of the picture: from `eye` along ray[0] + x ray[1] + y ray[2]; at 1/w of that is the
     * visible point.  Without perspective the ray starts at that vector instead, and ends at `depth` times ray[3]. */
    int has_perspective;
    float eye[3], ray[4][3];
    /* The depth cue: the light is mixed with fog_color by the share (distance - near) * fog_scale, 0 to 1; fog_scale 0:
     * no depth cue.  The distance is w times distance_scale, or distance_start + depth * distance_scale without
     * perspective. */
    float fog_color[3], fog_near, fog_scale, distance_start, distance_scale;
    const float *decode; /* (256,): the light of an sRGB value; NULL: colours of vertices are light */
    float background[4]; /* linear light and opacity */
    uint8_t background_bytes[4];
} tl_shading;

/* An instance of a picture: a mesh and its shading. */
typedef struct {
    const tl_snapped *snapped; /* its first_id is not read */
    const tl_shading *shading;
    int32_t first_id; /* the id of its triangle 0 in the picture */
} tl_shaded;

/* The instances of a picture, by ascending first ids; a single mesh is one instance.  All have one `show`, and share
 * the background, the samples, the fog and the view. */
typedef struct {
    const tl_shaded *instances;
    int64_t n;           /* at least 1 */
    const tl_view *view; /* or NULL in pixel space */
} tl_shaded_scene;

#endif
