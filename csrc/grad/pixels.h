/* Numbers of tensors, the visible pixels of a band some at a time, and sums by row.
 *
 * Loops over the pixels of a group are plain C that compilers turn into vectors: each lane does what one pixel needs,
 * so every instruction set gives the same bits. */
#ifndef TL_GRAD_PIXELS_H
#define TL_GRAD_PIXELS_H

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/inline.h"

#define TL_GROUP 64
#define TL_LAST_EXACT_ID (1 << 24) /* the largest that float32 counts up to; from there on its bits are counted */
#define TL_BITS_OF_LAST 0x4B800000

TL_INLINE double get_real(const void *p, int64_t i, int is_f64)
{
    return is_f64 ? ((const double *)p)[i] : (double)((const float *)p)[i];
}

TL_INLINE void put_real(void *p, int64_t i, double value, int is_f64)
{
    if (is_f64)
        ((double *)p)[i] = value;
    else
        ((float *)p)[i] = (float)value;
}

/* The number of the triangle that a pixel shows, -1 for none. */
TL_INLINE int32_t get_id(const void *rast, int64_t pixel, int is_f64)
{
    if (is_f64) {
        const double id = ((const double *)rast)[4 * pixel + 3];
        return id >= 1.0 ? id < 0x1p31 ? (int32_t)(id - 1.0) : INT32_MAX : -1;
    }
    const float id = ((const float *)rast)[4 * pixel + 3];
    if (!(id >= 1.0f))
        return -1;
    if (id <= TL_LAST_EXACT_ID)
        return (int32_t)id - 1;
    int32_t bits;
    memcpy(&bits, &id, sizeof bits);
    return bits - TL_BITS_OF_LAST + TL_LAST_EXACT_ID - 1;
}

TL_INLINE void put_id(void *rast, int64_t pixel, int32_t id, int is_f64)
{
    if (is_f64 || id < TL_LAST_EXACT_ID) {
        put_real(rast, 4 * pixel + 3, (double)id + 1.0, is_f64);
        return;
    }
    const int32_t bits = id + 1 - TL_LAST_EXACT_ID + TL_BITS_OF_LAST;
    memcpy((float *)rast + 4 * pixel + 3, &bits, sizeof bits);
}

/* Whether a triangle exists, and its corners do: what has been checked may have been changed since. */
TL_INLINE int has_corners(const tl_grad_view *view, int64_t n_rows, int32_t id)
{
    if (id >= view->n_triangles)
        return 0;
    const int32_t *c = view->tri + 3 * (int64_t)id;
    const uint64_t n = (uint64_t)n_rows;
    return (uint64_t)(int64_t)c[0] < n && (uint64_t)(int64_t)c[1] < n && (uint64_t)(int64_t)c[2] < n;
}

/* Where a walk over the visible pixels of a band is. */
typedef struct {
    int64_t row, column;
    int64_t bad_id; /* a number that is no triangle's, -1: none was met */
} band_place;

/* Visible pixels, in order. */
typedef struct {
    int n, padded; /* the lanes up to `padded` are computed, too */
    int32_t id[TL_GROUP];
    int64_t at[TL_GROUP]; /* pixel of the picture */
    int64_t row[TL_GROUP], column[TL_GROUP];
} pixel_group;

TL_INLINE void start_band(const tl_grad_view *view, band_place *place, pixel_group *group)
{
    *place = (band_place){view->first_row, 0, -1};
    memset(group, 0, sizeof *group);
}

TL_INLINE void add_pixel(pixel_group *group, const band_place *place, int64_t width, int32_t id)
{
    const int i = group->n++;
    group->id[i] = id;
    group->at[i] = place->row * width + place->column;
    group->row[i] = place->row, group->column[i] = place->column;
}

/* The next pixels of `rast`, whose triangles have rows below n_rows; 0 when there are no more. */
TL_INLINE int next_group(const tl_grad_view *view, const void *rast, int64_t n_rows, band_place *place,
                         pixel_group *group, int is_f64)
{
    int32_t last = -1;
    for (group->n = 0; place->row < view->end_row; place->row++, place->column = 0)
        for (; place->column < view->width; place->column++) {
            const int32_t id = get_id(rast, place->row * view->width + place->column, is_f64);
            if (id < 0)
                continue;
            if (id != last && !has_corners(view, n_rows, id)) {
                place->bad_id = id;
                continue;
            }
            if (group->n == TL_GROUP)
                goto full;
            add_pixel(group, place, view->width, last = id);
        }
full:
    group->padded = (group->n + 7) & ~7;
    return group->n;
}

/* The sums of a row. */
TL_INLINE double *sums_of(tl_grad_sums *sums, int64_t row)
{
    int32_t slot = sums->slot_of[row];
    if (slot < 0) {
        slot = sums->slot_of[row] = (int32_t)sums->n++;
        sums->rows[slot] = (int32_t)row;
        memset(sums->sums + slot * sums->n_columns, 0, (size_t)sums->n_columns * sizeof(double));
    }
    return sums->sums + slot * sums->n_columns;
}

/* The same of the three corners of a triangle.  Slots may move no sums, so pointers stay. */
TL_INLINE void corner_sums(const tl_grad_view *view, tl_grad_sums *sums, int32_t id, double **out)
{
    for (int k = 0; k < 3; k++)
        out[k] = sums_of(sums, view->tri[3 * (int64_t)id + k]);
}

/* Ends a band: rows have no place again. */
TL_INLINE void leave_band(tl_grad_sums *sums)
{
    for (int64_t i = 0; i < sums->n; i++)
        sums->slot_of[sums->rows[i]] = -1;
}

TL_INLINE double clamped(double a, double low, double high) { return a < low ? low : a > high ? high : a; }

#endif
