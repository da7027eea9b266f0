/* Lens: projects points by a lens, a vector of points at a time.
 * In: points in eye space, a lens.  Out: points that a camera without the lens would project there; records of those
 * well inside the picture, by which edges are tested for straightness.
 *
 * Based on: D. C. Brown, Close-Range Camera Calibration, 1971 (radial and tangential terms); J. Kannala and S. S.
 * Brandt, A Generic Camera Model, 2006 (the fisheye); both with the terms and names of OpenCV. */
#ifndef TL_LENS_C
#define TL_LENS_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/angle.h"
#include "lanes/lanes.h"
#include "mesh/lens.h"

#define TL_PI 0x1.921fb54442d18p+1
#define TL_LEAST_RANGE 0x1p-1022

/* Records: the unit direction, and the squared chord within which edges are straight; or one of these constants. */
#define TL_NOT_PLAIN -1.0f
#define TL_TOO_NEAR -2.0f /* and nearer than the near plane */

/* Points in camera axes, and their projection by the lens. */
typedef struct {
    vd p[3], far, off_axis, direction[3];
    vd place[2], reach;
} lens_lanes;

TL_INLINE vd vd_fixed(double a, vd b, double c) { return vd_add(vd_mul(vd_set1(a), b), vd_set1(c)); }

/* Projects onto the plane that tau_x, then tau_y tilt. */
static void tilt_lanes(const tl_lens *lens, vd *place)
{
    const double cos_x = lens->tilt[0], sin_x = lens->tilt[1], cos_y = lens->tilt[2], sin_y = lens->tilt[3];
    const vd u = place[0], v = place[1], depth = vd_set1(cos_y * cos_x);
    const vd a = vd_sub(vd_add(vd_mul(vd_set1(cos_y), u), vd_mul(vd_set1(sin_x * sin_y), v)), vd_set1(sin_y * cos_x));
    const vd b = vd_fixed(cos_x, v, sin_x);
    const vd c = vd_add(vd_sub(vd_mul(vd_set1(sin_y), u), vd_mul(vd_set1(cos_y * sin_x), v)), depth);
    place[0] = vd_div(vd_add(vd_mul(depth, a), vd_mul(vd_set1(sin_y * cos_x), c)), c);
    place[1] = vd_div(vd_sub(vd_mul(depth, b), vd_mul(vd_set1(sin_x), c)), c);
}

/* 1 + t (k1 + t (k2 + t k3)) */
TL_INLINE vd cubic(const double *k, vd t)
{
    const vd inner = vd_add(vd_set1(k[1]), vd_mul(t, vd_set1(k[2])));
    return vd_add(vd_set1(1.0), vd_mul(t, vd_add(vd_set1(k[0]), vd_mul(t, inner))));
}

TL_INLINE void distort_opencv(const tl_lens *lens, const vd *p, vd *place)
{
    vd q[3];
    vd_quotients(p, p[2], q, 0);
    const vd x = q[0], y = q[1], two = vd_set1(2.0), x2 = vd_mul(two, x), y2 = vd_mul(two, y);
    const vd r2 = vd_add(vd_mul(x, x), vd_mul(y, y));
    vd radial = cubic(lens->k, r2);
    if (lens->k[3] != 0.0 || lens->k[4] != 0.0 || lens->k[5] != 0.0)
        radial = vd_div(radial, cubic(lens->k + 3, r2));
    const vd p1 = vd_set1(lens->p[0]), p2 = vd_set1(lens->p[1]), xy = vd_mul(x2, y);
    const vd u = vd_add(vd_mul(x, radial), vd_mul(p1, xy)), v = vd_add(vd_mul(y, radial), vd_mul(p2, xy));
    place[0] = vd_add(u, vd_mul(p2, vd_add(r2, vd_mul(x2, x))));
    place[1] = vd_add(v, vd_mul(p1, vd_add(r2, vd_mul(y2, y))));
    if (lens->has_prism) {
        const double *s = lens->s;
        place[0] = vd_add(place[0], vd_mul(r2, vd_fixed(s[1], r2, s[0])));
        place[1] = vd_add(place[1], vd_mul(r2, vd_fixed(s[3], r2, s[2])));
    }
    if (lens->is_tilted)
        tilt_lanes(lens, place);
}

/* The angle from the axis. */
TL_INLINE vd angle_off_axis(vd off_axis, vd z)
{
    const vd angle = angle_of(off_axis, vd_abs(z));
    return vd_select(vd_ge(z, vd_set1(0.0)), angle, vd_sub(vd_set1(TL_PI), angle));
}

TL_INLINE void distort_fisheye(const tl_lens *lens, const vd *p, vd off_axis, vd *place)
{
    const vd angle = angle_off_axis(off_axis, p[2]), t2 = vd_mul(angle, angle), zero = vd_set1(0.0);
    const vd inner = vd_add(vd_set1(lens->k[2]), vd_mul(t2, vd_set1(lens->k[3])));
    const vd outer = vd_add(vd_set1(lens->k[0]), vd_mul(t2, vd_add(vd_set1(lens->k[1]), vd_mul(t2, inner))));
    const vd bent = vd_mul(angle, vd_add(vd_set1(1.0), vd_mul(t2, outer)));
    const vm is_on_axis = vd_ge(zero, off_axis);
    const vd scale = vd_select(is_on_axis, zero, vd_div(bent, vd_select(is_on_axis, vd_set1(1.0), off_axis)));
    place[0] = vd_mul(p[0], scale), place[1] = vd_mul(p[1], scale);
}

/* Sets distances, directions and ranges of points. */
TL_INLINE void measure_lanes(const tl_lens *lens, lens_lanes *l)
{
    const vd *p = l->p, zero = vd_set1(0.0), one = vd_set1(1.0);
    const vd sides = vd_add(vd_mul(p[0], p[0]), vd_mul(p[1], p[1]));
    l->off_axis = vd_sqrt(sides), l->far = vd_sqrt(vd_add(sides, vd_mul(p[2], p[2])));
    const vm is_none = vd_ge(zero, l->far);
    const vd inverse = vd_div(one, vd_select(is_none, one, l->far));
    for (int k = 0; k < 3; k++)
        l->direction[k] = vd_select(is_none, k == 2 ? one : zero, vd_mul(p[k], inverse));
    l->reach = vd_max(lens->is_fisheye ? l->far : p[2], vd_mul(l->far, vd_set1(lens->least_cosine)));
    l->reach = vd_max(l->reach, vd_set1(TL_LEAST_RANGE));
}

TL_INLINE void distort_lanes(const tl_lens *lens, const vd *p, vd off_axis, vd *place)
{
    if (lens->is_fisheye)
        distort_fisheye(lens, p, off_axis, place);
    else
        distort_opencv(lens, p, place);
}

/* Places points beyond the limit, in m: from their place at the limit on outwards, evenly. */
static void go_on_outwards(const tl_lens *lens, lens_lanes *l, vm m)
{
    const vd zero = vd_set1(0.0), one = vd_set1(1.0);
    const vm is_on_axis = vd_ge(zero, l->off_axis);
    const vd inverse = vd_div(one, vd_select(is_on_axis, one, l->off_axis)), sine = vd_set1(lens->limit_sine);
    const vd x = vd_select(is_on_axis, one, vd_mul(l->p[0], inverse));
    const vd y = vd_select(is_on_axis, zero, vd_mul(l->p[1], inverse));
    const vd rim[3] = {vd_mul(sine, x), vd_mul(sine, y), vd_set1(lens->limit_cosine)};
    const vd beyond = vd_sub(angle_off_axis(l->off_axis, l->p[2]), vd_set1(lens->limit));
    const vd outwards = vd_mul(vd_set1(lens->slope), beyond);
    vd place[2];
    distort_lanes(lens, rim, sine, place);
    l->place[0] = vd_select(m, vd_add(place[0], vd_mul(outwards, x)), l->place[0]);
    l->place[1] = vd_select(m, vd_add(place[1], vd_mul(outwards, y)), l->place[1]);
}

/* Projects any points. */
static void see_lanes(const tl_lens *lens, lens_lanes *l)
{
    measure_lanes(lens, l);
    distort_lanes(lens, l->p, l->off_axis, l->place);
    const vm beyond = vm_and_not(vm_all(), vd_ge(l->direction[2], vd_set1(lens->limit_cosine)));
    if (vm_any(beyond))
        go_on_outwards(lens, l, beyond);
}

/* Makes the records of points in float32: their users allow for its error.  TL_TOO_NEAR is certain. */
TL_INLINE void make_records(const tl_lens *lens, const vd *p, vf *record)
{
    const vf x = vf_from_vd(p[0]), y = vf_from_vd(p[1]), z = vf_from_vd(p[2]);
    const vf far = vf_sqrt(vf_add(vf_add(vf_mul(x, x), vf_mul(y, y)), vf_mul(z, z)));
    const vf inverse = vf_div(vf_set1(1.0f), far), one = vf_set1(1.0f);
    record[0] = vf_mul(x, inverse), record[1] = vf_mul(y, inverse), record[2] = vf_mul(z, inverse);
    const vf ahead = vf_sub(one, record[2]);
    const vf sides = vf_add(vf_mul(record[0], record[0]), vf_mul(record[1], record[1]));
    const vf from_axis = vf_add(sides, vf_mul(ahead, ahead)); /* squared chord */
    const vi ring = vi_floor(vf_sqrt(vf_mul(from_axis, vf_set1(lens->ring_scale))));
    const vi last = vi_set1(TL_LENS_RINGS - 1);
    const vf allowed = vf_lookup(lens->allowed, vi_max(vi_min(ring, last), vi_set1(0)));
    const vf longer = vf_mul(far, vf_set1(lens->is_fisheye ? 1.0f : (float)lens->least_cosine));
    const vf reach = vf_mul(vf_max(z, longer), vf_set1(1.0f + 0x1p-18f));
    const vm is_far = vf_ge(reach, vf_set1((float)lens->near));
    const vm is_plain = vf_ge(vf_set1(lens->plain_chord), from_axis);
    record[3] = vf_select(is_plain, allowed, vf_set1(TL_NOT_PLAIN));
    record[3] = vf_select(is_far, record[3], vf_set1(TL_TOO_NEAR));
}

/* Loads up to TL_LANES rows of float32 or float64; other lanes repeat the last row. */
TL_INLINE void load_rows_of_three(const void *rows, int is_f32, int64_t i, int64_t n, vd *p)
{
    const float *f32 = (const float *)rows + 3 * i;
    const double *f64 = (const double *)rows + 3 * i;
    if (n > TL_LANES && is_f32) { /* reads two numbers past the last row */
        vf columns[4];
        load_columns_f32(f32, 3, columns);
        for (int axis = 0; axis < 3; axis++)
            p[axis] = vd_from_vf(columns[axis]);
    } else if (n > TL_LANES) {
        vd columns[4];
        load_columns_f64(f64, 3, columns);
        p[0] = columns[0], p[1] = columns[1], p[2] = columns[2];
    } else {
        double lanes[3][TL_MAX_LANES];
        for (int lane = 0; lane < TL_LANES; lane++)
            for (int axis = 0; axis < 3; axis++) {
                const int64_t at = 3 * (lane < n ? lane : n - 1) + axis;
                lanes[axis][lane] = is_f32 ? (double)f32[at] : f64[at];
            }
        for (int axis = 0; axis < 3; axis++)
            p[axis] = vd_load(lanes[axis]);
    }
}

/* From eye space to camera axes, or back. */
TL_INLINE void flip_axes(vd *p)
{
    const vd zero = vd_set1(0.0);
    p[1] = vd_sub(zero, p[1]), p[2] = vd_sub(zero, p[2]);
}

/* Transforms points by the rows of an affine matrix, as `move_points` does. */
TL_INLINE void move_lanes(const double *matrix, vd *p)
{
    const vd x = p[0], y = p[1], z = p[2];
    for (int k = 0; k < 3; k++) {
        const double *row = matrix + 4 * k;
        const vd sum = vd_add(vd_mul(x, vd_set1(row[0])), vd_mul(y, vd_set1(row[1])));
        p[k] = vd_add(vd_add(sum, vd_mul(z, vd_set1(row[2]))), vd_set1(row[3]));
    }
}

/* Writes n rows of three, TL_LANES at most. */
TL_INLINE void store_eye_points(double *rows, int64_t n, const vd *columns)
{
    double lanes[3][TL_MAX_LANES];
    for (int k = 0; k < 3; k++)
        vd_store(lanes[k], columns[k]);
    for (int lane = 0; lane < TL_LANES && lane < n; lane++)
        for (int k = 0; k < 3; k++)
            rows[3 * lane + k] = lanes[k][lane];
}

/* Points that are not plain get an arbitrary place. */
static void bend_vertices(const tl_lens *lens, const tl_source *source, const double *eye_from, int64_t first,
                          int64_t end, double *bent, float *records)
{
    const vd zero = vd_set1(0.0), one = vd_set1(1.0);
    for (int64_t i = first; i < end; i += TL_LANES) {
        const int64_t n = end - i;
        vd p[3], place[2], out[3] = {zero, zero, vd_sub(zero, one)};
        vf record[4];
        float lanes[4][TL_MAX_LANES];
        load_rows_of_three(source->data, source->scalar == TL_F32, i, n, p);
        move_lanes(eye_from, p);
        flip_axes(p);
        make_records(lens, p, record);
        const vm is_plain = vf_ge(record[3], vf_set1(0.0f));
        if (vm_any(is_plain)) {
            vd reach = p[2];
            if (lens->is_fisheye) {
                const vd sides = vd_add(vd_mul(p[0], p[0]), vd_mul(p[1], p[1]));
                reach = vd_sqrt(vd_add(sides, vd_mul(p[2], p[2])));
                distort_fisheye(lens, p, vd_sqrt(sides), place);
            } else {
                distort_opencv(lens, p, place);
            }
            out[0] = vd_select(is_plain, vd_mul(place[0], reach), zero);
            out[1] = vd_select(is_plain, vd_sub(zero, vd_mul(place[1], reach)), zero);
            out[2] = vd_select(is_plain, vd_sub(zero, reach), out[2]);
        }
        store_eye_points(bent + 3 * i, n, out);
        for (int k = 0; k < 4; k++)
            vf_store(lanes[k], record[k]);
        for (int lane = 0; lane < TL_LANES && lane < n; lane++)
            for (int k = 0; k < 4; k++)
                records[4 * (i + lane) + k] = lanes[k][lane];
    }
}

static void see_points(const tl_lens *lens, const double *points, int64_t n, double *places)
{
    for (int64_t i = 0; i < n; i += TL_LANES) {
        lens_lanes l;
        double lanes[2][TL_MAX_LANES];
        load_rows_of_three(points, 0, i, n - i, l.p);
        flip_axes(l.p);
        see_lanes(lens, &l);
        vd_store(lanes[0], l.place[0]), vd_store(lanes[1], l.place[1]);
        for (int lane = 0; lane < TL_LANES && i + lane < n; lane++)
            places[2 * (i + lane)] = lanes[0][lane], places[2 * (i + lane) + 1] = lanes[1][lane];
    }
}

#endif
