/* Atlas: a mesh's values at the texels of its texture coordinates.
 * In: triangles in texels, values of their corners, photos.  Out: values of texels.
 *
 * Based on: I. E. Sutherland, G. W. Hodgman, Reentrant Polygon Clipping, 1974 (the part of a triangle in a texel). */
#ifndef TL_ATLAS_C
#define TL_ATLAS_C

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/corners.h"
#include "grid/grid.h"

#define TL_MOST_PART 7 /* corners of a triangle cut by four lines */

typedef struct {
    double x[TL_MOST_PART + 1], y[TL_MOST_PART + 1];
    int n;
} texel_part;

/* The part of a polygon where sign * coordinate >= limit; the coordinate is x or, for is_y, y. */
static void cut_part(const texel_part *in, int is_y, double sign, double limit, texel_part *out)
{
    const double *along = is_y ? in->y : in->x;
    out->n = 0;
    for (int i = 0; i < in->n; i++) {
        const int j = i + 1 < in->n ? i + 1 : 0;
        const double a = sign * along[i] - limit, b = sign * along[j] - limit;
        if (a >= 0.0)
            out->x[out->n] = in->x[i], out->y[out->n] = in->y[i], out->n++;
        if ((a >= 0.0) != (b >= 0.0)) {
            const double t = a / (a - b);
            out->x[out->n] = is_y ? in->x[i] + t * (in->x[j] - in->x[i]) : sign * limit;
            out->y[out->n] = is_y ? sign * limit : in->y[i] + t * (in->y[j] - in->y[i]);
            out->n++;
        }
    }
}

/* The part of a triangle in the texel at (x, y): returns its doubled area, sets its centre. */
static double part_in_texel(const double (*c)[2], double x, double y, double *at)
{
    texel_part one = {{c[0][0], c[1][0], c[2][0]}, {c[0][1], c[1][1], c[2][1]}, 3}, other;
    cut_part(&one, 0, 1.0, x, &other);
    cut_part(&other, 0, -1.0, -(x + 1.0), &one);
    cut_part(&one, 1, 1.0, y, &other);
    cut_part(&other, 1, -1.0, -(y + 1.0), &one);
    double area = 0.0, sx = 0.0, sy = 0.0;
    for (int i = 2; i < one.n; i++) {
        const double ux = one.x[i - 1] - one.x[0], uy = one.y[i - 1] - one.y[0];
        const double vx = one.x[i] - one.x[0], vy = one.y[i] - one.y[0], own = ux * vy - uy * vx;
        area += own, sx += own * (ux + vx), sy += own * (uy + vy);
    }
    if (area == 0.0)
        return 0.0;
    at[0] = one.x[0] + sx / (3.0 * area), at[1] = one.y[0] + sy / (3.0 * area);
    return fabs(area);
}

/* Sets the box of a triangle in texels, clipped to the rows; returns whether it has texels. */
static int texel_box(const double (*c)[2], int64_t width, int64_t first_row, int64_t end_row, int64_t *box)
{
    const int64_t low[2] = {0, first_row}, end[2] = {width, end_row};
    for (int k = 0; k < 2; k++) {
        const double least = fmin(fmin(c[0][k], c[1][k]), c[2][k]), most = fmax(fmax(c[0][k], c[1][k]), c[2][k]);
        if (!(least < (double)end[k] && most >= (double)low[k]))
            return 0;
        box[k] = least > (double)low[k] ? (int64_t)least : low[k];
        box[2 + k] = most < (double)end[k] ? (int64_t)most + 1 : end[k];
    }
    return 1;
}

/* Barycentric weights of a point. */
static void weigh(const double (*c)[2], double doubled, double x, double y, double *w)
{
    w[1] = ((x - c[0][0]) * (c[2][1] - c[0][1]) - (y - c[0][1]) * (c[2][0] - c[0][0])) / doubled;
    w[2] = ((c[1][0] - c[0][0]) * (y - c[0][1]) - (c[1][1] - c[0][1]) * (x - c[0][0])) / doubled;
    w[0] = 1.0 - w[1] - w[2];
}

/* Sets the weights of the point of a triangle that is nearest to (x, y); returns the squared distance. */
static double nearest_in(const double (*c)[2], double doubled, double x, double y, double *w)
{
    if (doubled != 0.0) {
        weigh(c, doubled, x, y, w);
        if (w[0] >= 0.0 && w[1] >= 0.0 && w[2] >= 0.0)
            return 0.0;
    }
    double least = INFINITY;
    w[0] = w[1] = w[2] = 0.0;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3;
        const double ex = c[j][0] - c[i][0], ey = c[j][1] - c[i][1], length = ex * ex + ey * ey;
        double t = length > 0.0 ? ((x - c[i][0]) * ex + (y - c[i][1]) * ey) / length : 0.0;
        t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
        const double dx = c[i][0] + t * ex - x, dy = c[i][1] + t * ey - y, squared = dx * dx + dy * dy;
        if (squared < least) {
            least = squared;
            w[i] = 1.0 - t, w[j] = t, w[3 - i - j] = 0.0;
        }
    }
    return least;
}

static double take_triangle(const tl_atlas *a, int64_t i, double (*c)[2])
{
    for (int k = 0; k < 3; k++)
        memcpy(c[k], a->points + 2 * (int64_t)corner_within(a->triangles[3 * i + k], a->n_points), sizeof c[k]);
    return (c[1][0] - c[0][0]) * (c[2][1] - c[0][1]) - (c[1][1] - c[0][1]) * (c[2][0] - c[0][0]);
}

static const float *corner_values(const tl_atlas *a, int64_t triangle, int corner)
{
    return a->values + a->n_values * (a->per_corner
                                          ? 3 * triangle + corner
                                          : (int64_t)corner_within(a->triangles[3 * triangle + corner], a->n_points));
}

/* Values are those at the point nearest to the texel's centre.  Of several nearest triangles the first is taken. */
static void touch_texels(const tl_atlas *a, int64_t first, int64_t end, int32_t *ids, float *squared, float *out)
{
    for (int64_t i = 0; i < a->n_triangles; i++) {
        double c[3][2], at[2], w[3];
        int64_t box[4];
        const double doubled = take_triangle(a, i, c);
        if (!texel_box((const double (*)[2])c, a->width, first, end, box))
            continue;
        for (int64_t y = box[1]; y < box[3]; y++)
            for (int64_t x = box[0]; x < box[2]; x++) {
                const int64_t texel = y * a->width + x;
                float *const best = squared + (y - first) * a->width + x;
                if (ids[texel] >= 0 && *best == INFINITY) /* a triangle covers its centre */
                    continue;
                if (!(part_in_texel((const double (*)[2])c, (double)x, (double)y, at) > 0.0))
                    continue;
                const float own =
                    (float)nearest_in((const double (*)[2])c, doubled, (double)x + 0.5, (double)y + 0.5, w);
                if (!(own < *best))
                    continue;
                *best = own;
                ids[texel] = (int32_t)i;
                for (int k = 0; k < a->n_values; k++) {
                    double value = 0.0;
                    for (int corner = 0; corner < 3; corner++)
                        value += w[corner] * (double)corner_values(a, i, corner)[k];
                    out[texel * a->n_values + k] = (float)value;
                }
            }
    }
}

/* `out` is the mean of the values over the covered areas.  `ids` is the triangle with the largest area in the texel,
 * the first of several. */
static void average_texels(const tl_atlas *a, int64_t first, int64_t end, double *sums, float *most, int32_t *ids,
                           float *out)
{
    const int64_t stride = 1 + a->n_values;
    for (int64_t i = 0; i < a->n_triangles; i++) {
        double c[3][2], at[2], w[3];
        int64_t box[4];
        const double doubled = take_triangle(a, i, c);
        if (doubled == 0.0 || !texel_box((const double (*)[2])c, a->width, first, end, box))
            continue;
        for (int64_t y = box[1]; y < box[3]; y++)
            for (int64_t x = box[0]; x < box[2]; x++) {
                const double area = 0.5 * part_in_texel((const double (*)[2])c, (double)x, (double)y, at);
                if (!(area > 0.0))
                    continue;
                const int64_t row = (y - first) * a->width + x;
                weigh((const double (*)[2])c, doubled, at[0], at[1], w);
                sums[row * stride] += area;
                for (int corner = 0; corner < 3; corner++) {
                    const float *own = corner_values(a, i, corner);
                    for (int k = 0; k < a->n_values; k++)
                        sums[row * stride + 1 + k] += area * w[corner] * (double)own[k];
                }
                if ((float)area > most[row]) {
                    most[row] = (float)area;
                    ids[y * a->width + x] = (int32_t)i;
                }
            }
    }
    for (int64_t texel = 0; texel < (end - first) * a->width; texel++)
        for (int k = 0; k < a->n_values && sums[texel * stride] > 0.0; k++)
            out[(first * a->width + texel) * a->n_values + k] =
                (float)(sums[texel * stride + 1 + k] / sums[texel * stride]);
}

/* `along` is the distance to the nearest texel with an id, the left of two; TL_NO_TEXEL where none is within
 * `reach`. */
static void find_in_rows(const int32_t *ids, int64_t width, int64_t first, int64_t end, int reach, int16_t *along)
{
    for (int64_t y = first; y < end; y++) {
        const int32_t *row = ids + y * width;
        int16_t *own = along + y * width;
        int64_t last = -TL_NO_TEXEL;
        for (int64_t x = 0; x < width; x++) {
            last = row[x] >= 0 ? x : last;
            own[x] = (int16_t)(x - last <= reach ? last - x : TL_NO_TEXEL);
        }
        last = width + TL_NO_TEXEL;
        for (int64_t x = width - 1; x >= 0; x--) {
            last = row[x] >= 0 ? x : last;
            const int16_t before = own[x] < 0 ? (int16_t)-own[x] : own[x];
            if (last - x <= reach && last - x < before)
                own[x] = (int16_t)(last - x);
        }
    }
}

/* Of several nearest texels the one in the lowest row is taken. */
static void find_gutter(const int16_t *along, int64_t width, int64_t height, int64_t first, int64_t end, int reach,
                        int32_t *room, int32_t *from)
{
    int32_t *const best = room, *const steps = room + width;
    for (int64_t y = first; y < end; y++) {
        const int64_t top = y - reach > 0 ? y - reach : 0, bottom = y + reach < height - 1 ? y + reach : height - 1;
        for (int64_t x = 0; x < width; x++)
            best[x] = reach * reach + 1;
        for (int64_t r = top; r <= bottom; r++) {
            const int16_t *const row = along + r * width;
            const int32_t dy = (int32_t)((r - y) * (r - y)), at = (int32_t)(r - y) * (1 << 16);
            for (int64_t x = 0; x < width; x++) {
                const int32_t dx = row[x], squared = dx * dx + dy, is_nearer = squared < best[x];
                best[x] = is_nearer ? squared : best[x];
                steps[x] = is_nearer ? at + dx : steps[x];
            }
        }
        for (int64_t x = 0; x < width; x++) {
            const int32_t dx = (int16_t)steps[x], dy = (steps[x] - dx) / (1 << 16);
            from[y * width + x] = best[x] <= reach * reach ? (int32_t)((y + dy) * width + x + dx) : -1;
        }
    }
}

static void copy_texels(const int32_t *from, int64_t first, int64_t end, int64_t n_bytes, uint8_t *texels)
{
    for (int64_t i = first; i < end; i++)
        if (from[i] >= 0 && from[i] != i)
            memcpy(texels + i * n_bytes, texels + from[i] * n_bytes, (size_t)n_bytes);
}

/* Whether a photo shows the point of texel `id` at its pixel (x, y): one of the four nearest pixels has its id, or no
 * nearer depth. */
static int is_seen(const tl_taken *t, double x, double y, double z, int32_t id)
{
    const int64_t left = (int64_t)floor(x - 0.5), top = (int64_t)floor(y - 0.5);
    for (int64_t row = top; row < top + 2; row++)
        for (int64_t column = left; column < left + 2; column++) {
            if (row < 0 || column < 0 || row >= t->height || column >= t->width)
                continue;
            const int64_t at = row * t->width + column;
            if (t->ids[at] >= 0 && (t->ids[at] == id || z <= (double)t->depth[at] + 0x1p-20))
                return 1;
        }
    return 0;
}

/* The light of a photo at (x, y): bilinear, of the nearest pixels that show the mesh. */
static void take_light(const tl_taken *t, double x, double y, float *light)
{
    const double left = floor(x - 0.5), top = floor(y - 0.5), wx = x - 0.5 - left, wy = y - 0.5 - top;
    double sums[TL_MOST_CHANNELS] = {0.0}, total = 0.0;
    for (int k = 0; k < 4; k++) {
        const int64_t column = (int64_t)left + (k & 1), row = (int64_t)top + (k >> 1), at = row * t->width + column;
        if (row < 0 || column < 0 || row >= t->height || column >= t->width || t->ids[at] < 0)
            continue;
        const double weight = (k & 1 ? wx : 1.0 - wx) * (k >> 1 ? wy : 1.0 - wy) + 0x1p-40; /* never 0 */
        total += weight;
        for (int c = 0; c < t->n_channels; c++)
            sums[c] += weight * (double)t->light[at * t->n_channels + c];
    }
    for (int c = 0; c < t->n_channels; c++)
        light[c] = (float)(sums[c] / total); /* total > 0: see `is_seen` */
}

/* The weight is the squared cosine of the view over the squared distance; with keeps_best the light with the largest
 * weight is kept. */
static void add_taken(const tl_taken *t, const float *positions, const float *normals, const int32_t *ids,
                      int64_t first, int64_t end, float *sums, float *weights)
{
    for (int64_t i = first; i < end; i++) {
        const float *const p = positions + 3 * i, *const normal = normals + 3 * i;
        double clip[4], ray[3], length = 0.0, cosine = 0.0;
        if (ids[i] < 0)
            continue;
        for (int k = 0; k < 4; k++) {
            const double *m = t->clip_from_object + 4 * k;
            clip[k] = m[0] * (double)p[0] + m[1] * (double)p[1] + m[2] * (double)p[2] + m[3];
        }
        for (int k = 0; k < 3; k++) {
            ray[k] = t->eye[k] - t->eye[3] * (double)p[k];
            length += ray[k] * ray[k];
            cosine += ray[k] * (double)normal[k];
        }
        if (!(clip[3] > 0.0 && cosine > 0.0))
            continue;
        const double x = (clip[0] / clip[3] + 1.0) * 0.5 * (double)t->width;
        const double y = (1.0 - clip[1] / clip[3]) * 0.5 * (double)t->height;
        const double z = (clip[2] / clip[3] + 1.0) * 0.5;
        if (!(x >= 0.0 && y >= 0.0 && x < (double)t->width && y < (double)t->height) || !is_seen(t, x, y, z, ids[i]))
            continue;
        const float weight = (float)(cosine * cosine / length);
        float light[TL_MOST_CHANNELS];
        take_light(t, x, y, light);
        if (t->keeps_best && !(weight > weights[i]))
            continue;
        for (int k = 0; k < t->n_channels; k++)
            sums[i * t->n_channels + k] =
                t->keeps_best ? weight * light[k] : sums[i * t->n_channels + k] + weight * light[k];
        weights[i] = t->keeps_best ? weight : weights[i] + weight;
    }
}

#endif
