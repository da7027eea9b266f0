/* Planes: the value of each pixel on its triangle, in float64, from vertices before the snap.
 * In: triangle ids, float64 points in pixels, a value for each point.  Out: values at the pixel centres; NaN for the
 * background.
 *
 * Snapped vertices decide coverage, so a centre may lie a fraction of a sub-pixel outside of the exact triangle: the
 * value is clamped to the three values of the corners. */
#ifndef TL_PLANES_C
#define TL_PLANES_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"

/* The plane of one triangle: TL_PLANE_DOUBLES, a cache line. */
typedef struct {
    int64_t id; /* -1: empty */
    double x, y, value, slope_x, slope_y, low, high;
} value_plane;

/* Recently used planes: a row often shows the triangles of the row before.  A power of two; 512 of them are 32 KiB. */
#define TL_N_RECENT_PLANES 512

static inline double lower(double a, double b) { return b < a ? b : a; }
static inline double upper(double a, double b) { return b > a ? b : a; }

static void load_plane(value_plane *p, const tl_valued *mesh, int64_t id)
{
    double x[3], y[3], v[3];
    p->id = id;
    for (int k = 0; k < 3; k++) {
        const int64_t corner = mesh->triangles[3 * id + k];
        if (corner < 0 || corner >= mesh->n_points) { /* the caller's array may have changed */
            p->x = p->y = p->slope_x = p->slope_y = 0.0;
            p->value = p->low = p->high = TL_NAN;
            return;
        }
        x[k] = mesh->points_px[2 * corner];
        y[k] = mesh->points_px[2 * corner + 1];
        v[k] = mesh->values[corner];
    }
    const double ax = x[1] - x[0], ay = y[1] - y[0], bx = x[2] - x[0], by = y[2] - y[0];
    const double av = v[1] - v[0], bv = v[2] - v[0], twice_area = ax * by - ay * bx;
    p->x = x[0], p->y = y[0], p->value = v[0];
    p->low = lower(lower(v[0], v[1]), v[2]), p->high = upper(upper(v[0], v[1]), v[2]);
    p->slope_x = p->slope_y = 0.0; /* only the snap gave it an area: no slope is right, so it is flat */
    if (twice_area != 0.0) {
        p->slope_x = (av * by - bv * ay) / twice_area;
        p->slope_y = (bv * ax - av * bx) / twice_area;
    }
}

static const value_plane NO_PLANE = {.id = -1, .value = TL_NAN, .low = TL_NAN, .high = TL_NAN};

static void list_planes(const tl_valued *mesh, int64_t first, int64_t end)
{
    value_plane *planes = (value_plane *)mesh->planes;
    if (first == 0)
        planes[0] = NO_PLANE;
    for (int64_t id = first; id < end; id++)
        load_plane(planes + 1 + id, mesh, id);
}

/* The centre of the first pixel of a row. */
typedef struct {
    double x_px, y_px;
} row_start;

TL_INLINE void fill_pixel(const value_plane *p, int64_t col, row_start at, int is_f32, void *row)
{
    const double start = p->value + p->slope_y * (at.y_px - p->y);
    double value = start + p->slope_x * ((double)col + at.x_px - p->x);
    value = value < p->low ? p->low : value;
    value = value > p->high ? p->high : value;
    if (is_f32)
        ((float *)row)[col] = (float)value;
    else
        ((double *)row)[col] = value;
}

/* Pixels ahead for which planes are prefetched: they are in a distant cache, and their ids are known. */
#define TL_PLANES_AHEAD 32

/* Small triangles: pixel by pixel from listed planes, without a branch at the end of a triangle. */
TL_INLINE void fill_listed(const value_plane *planes, int64_t n_triangles, const int32_t *ids, int64_t width,
                           row_start at, int is_f32, void *row)
{
    for (int64_t col = 0; col < width; col++) {
        const int64_t id = ids[col];
        if (col + TL_PLANES_AHEAD < width)
            __builtin_prefetch(planes + 1 + ids[col + TL_PLANES_AHEAD]);
        fill_pixel(planes + (id >= 0 && id < n_triangles ? 1 + id : 0), col, at, is_f32, row);
    }
}

/* Large triangles: run by run. */
TL_INLINE void fill_run(const value_plane *p, int64_t first, int64_t end, row_start at, int is_f32, void *row)
{
    const value_plane plane = *p; /* a copy: stores to the row cannot alias it */
    for (int64_t col = first; col < end; col++)
        fill_pixel(&plane, col, at, is_f32, row);
}

static void fill_planes(const tl_valued *mesh, const tl_window *window, const int32_t *ids, int is_f32, void *out)
{
    value_plane recent[TL_N_RECENT_PLANES];
    for (int k = 0; k < TL_N_RECENT_PLANES; k++)
        recent[k].id = -1;
    for (int64_t i = 0; i < window->height; i++, ids += window->width) {
        void *row = (char *)out + i * window->width * (is_f32 ? 4 : 8);
        const row_start at = {(double)window->x_px + 0.5, (double)(window->y_px + i) + 0.5};
        if (mesh->planes) {
            const value_plane *planes = (const value_plane *)mesh->planes;
            if (is_f32)
                fill_listed(planes, mesh->n_triangles, ids, window->width, at, 1, row);
            else
                fill_listed(planes, mesh->n_triangles, ids, window->width, at, 0, row);
            continue;
        }
        for (int64_t first = 0, end; first < window->width; first = end) {
            const int32_t id = ids[first];
            for (end = first + 1; end < window->width && ids[end] == id; end++)
                ;
            const value_plane *plane = &NO_PLANE;
            if (id >= 0 && id < mesh->n_triangles) {
                value_plane *own = &recent[id & (TL_N_RECENT_PLANES - 1)];
                if (own->id != id)
                    load_plane(own, mesh, id);
                plane = own;
            }
            if (is_f32)
                fill_run(plane, first, end, at, 1, row);
            else
                fill_run(plane, first, end, at, 0, row);
        }
    }
}

#endif
