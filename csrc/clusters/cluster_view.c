/* A view of a clustered mesh: which clusters it needs, which of them are occluded, and a cluster as a mesh whose
 * vertices stay in the first-level cache.
 * In: a clustered mesh in object space, a matrix; then a depth buffer.  Out: the clusters that may draw a sample;
 * snapped vertices and triangles, which raster.c draws.
 *
 * Skipped clusters draw nothing, wherever the snap puts their vertices: every test leaves room for the errors of the
 * vertex stage and of the snap.
 *
 * Based on: U. Assarsson, T. Möller, Optimized View Frustum Culling Algorithms for Bounding Boxes, 2000; N. Greene, M.
 * Kass, G. Miller, Hierarchical Z-Buffer Visibility, 1993 (with one level: clusters are small in the picture). */
#ifndef TL_CLUSTER_VIEW_C
#define TL_CLUSTER_VIEW_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "vertex/project.c"
#include "clusters/behind.h"
#include "clusters/clusters.h"

/* Row i of the matrix over a box: its value at the centre, its largest deviation from it, and a bound of the sum of its
 * absolute terms. */
typedef struct {
    double centre, reach, terms;
} form_bounds;

/* A box transformed by a matrix. */
typedef struct {
    double centre[3], half[3];
    form_bounds f[4];
} seen_box;

#define TL_N_SIDES 6      /* left, right, above, below, near, far */
#define TL_IN_DEPTH 0x30u /* within near and far: no triangle is clipped into pieces, which have other corners */

static inline seen_box place_box(const double *low, const double *high, const double *matrix)
{
    seen_box b;
    for (int k = 0; k < 3; k++) {
        b.centre[k] = 0.5 * (low[k] + high[k]);
        b.half[k] = 0.5 * (high[k] - low[k]) + 0x1p-50 * (fabs(low[k]) + fabs(high[k]));
    }
    for (int i = 0; i < 4; i++) {
        const double *row = matrix + 4 * i;
        b.f[i] = (form_bounds){row[3], 0.0, fabs(row[3])};
        for (int k = 0; k < 3; k++) {
            b.f[i].centre += row[k] * b.centre[k];
            b.f[i].reach += fabs(row[k]) * b.half[k];
            b.f[i].terms += fabs(row[k]) * (fabs(b.centre[k]) + b.half[k]);
        }
    }
    return b;
}

/* a * (row i) + b * w over a box: returns its value at the centre; *reach: the largest deviation, with the errors of
 * the vertex stage. */
static inline double mixed_form(const seen_box *box, const tl_cluster_view *v, int i, double a, double b, double *reach)
{
    const double *row = v->matrix + 4 * i, *row_w = v->matrix + 12;
    *reach = v->error * (fabs(a) * box->f[i].terms + fabs(b) * box->f[3].terms);
    for (int k = 0; k < 3; k++)
        *reach += fabs(a * row[k] + b * row_w[k]) * box->half[k];
    return a * box->f[i].centre + b * box->f[3].centre;
}

/* Whether a box is certainly outside of the window.  If not, adds the sides that it is certainly within to `within`;
 * sides in `within` on entry are not tested. */
static int is_outside(const seen_box *box, const tl_cluster_view *v, unsigned *within)
{
    const double near_w = v->zero_to_one ? 0.0 : 1.0;
    for (int side = 0; side < TL_N_SIDES; side++) {
        if (*within >> side & 1)
            continue;
        if ((side == 4 && !v->near_clip) || (side == 5 && !v->far_clip)) {
            *within |= 1u << side;
            continue;
        }
        double reach;
        const double value = side < 4    ? mixed_form(box, v, side / 2, v->side[side][0], v->side[side][1], &reach)
                             : side == 4 ? mixed_form(box, v, 2, 1.0, near_w, &reach)
                                         : mixed_form(box, v, 2, -1.0, 1.0, &reach);
        if (value + reach < 0.0)
            return 1;
        if (value - reach > 0.0)
            *within |= 1u << side;
    }
    return 0;
}

/* Whether a box within the near and far planes certainly holds no sample after the snap, as most clusters with many
 * triangles per pixel.
 *
 * x / w of the centre is q; elsewhere it differs by (x - q w) / w, which is small near the centre. */
static int is_between_samples(const seen_box *box, const tl_cluster_view *v)
{
    const double w_min = box->f[3].centre - box->f[3].reach - v->error * box->f[3].terms;
    if (!(v->has_one_sample && w_min > 0.0))
        return 0;
    const double half[2] = {v->half_width_px, -v->half_height_px}, scale[2] = {v->scale_x, v->scale_y};
    for (int k = 0; k < 2; k++) {
        const double q = box->f[k].centre / box->f[3].centre;
        double reach;
        const double middle = mixed_form(box, v, k, 1.0, -q, &reach);
        reach += fabs(middle) + v->error * (box->f[k].terms + fabs(q) * box->f[3].terms);
        const double at = half[k] * q + (fabs(half[k]) - v->sample_px[k]);
        const double moved = 0.75 * fabs(half[k]) / scale[k] + 0x1p-50 * (fabs(at) + fabs(half[k])); /* by the snap */
        const double far = fabs(half[k]) * reach / w_min + moved;
        if (floor(at + far) < at - far)
            return 1;
    }
    return 0;
}

/* Whether every triangle of a box within the near and far planes certainly faces the culled way after the snap.
 *
 * The screen area of a triangle is n . g(a) times a factor, with g(a) = k - k3 a, where (k, k3) is the eye: the rows of
 * x, y and w map it to 0.  The vertex stage and the snap move corners by less than d sub-pixels, which changes twice
 * the area by less than 4 d (lx + ly) + 8 d^2 sub-pixels^2 when no side is longer than (lx, ly). */
static int is_turned_away(const tl_cluster *c, const tl_cluster_view *v, const seen_box *box)
{
    const form_bounds *f = box->f;
    const double w_min = f[3].centre - f[3].reach - v->error * f[3].terms;
    const double w_max = f[3].centre + f[3].reach + v->error * f[3].terms;
    if (!(c->cone_cos > 0.0 && w_min > 0.0))
        return 0;
    const double sign = v->cull == TL_CULL_BACK ? -1.0 : 1.0;
    const double radius =
        sqrt((box->half[0] * box->half[0] + box->half[1] * box->half[1]) + box->half[2] * box->half[2]);
    double g[3], squares = 0.0, along = 0.0;
    for (int k = 0; k < 3; k++) {
        g[k] = sign * (v->eye[k] - v->eye[3] * box->centre[k]);
        squares += g[k] * g[k];
        along += g[k] * c->axis[k];
    }
    const double length = sqrt(squares);
    along /= length;
    const double across = sqrt(fmax(0.0, 1.0 - along * along));
    const double cone_sin = sqrt(fmax(0.0, 1.0 - c->cone_cos * c->cone_cos));
    const double least = 0.999 * length * (along * c->cone_cos - across * cone_sin) - 1.001 * fabs(v->eye[3]) * radius;
    const double factor = least * (v->scale_x * v->scale_y) / (w_max * w_max * w_max);
    double sides = 0.0, moved = 0.0;
    const double scale[2] = {v->scale_x, v->scale_y};
    for (int k = 0; k < 2; k++) {
        const double largest = (fabs(f[k].centre) + f[k].reach) / w_min;
        moved = fmax(moved, 0.75 + scale[k] * v->error * (f[k].terms + largest * f[3].terms) / w_min);
        sides += 1.001 * scale[k] * (v->length[k] + largest * v->length[2]) / w_min;
    }
    return c->min_height * factor > 8.0 * moved * sides && c->min_area * factor > 16.0 * moved * moved;
}

/* Whether the cluster roughly shows its back, or the culled side: it is then drawn late, when nearer surfaces may
 * occlude it. */
static int shows_back(const tl_cluster *c, const tl_cluster_view *v, const seen_box *box)
{
    double along = 0.0;
    for (int k = 0; k < 3; k++)
        along += (v->eye[k] - v->eye[3] * box->centre[k]) * c->axis[k];
    return v->cull == TL_CULL_FRONT ? along > 0.0 : along < 0.0;
}

/* ---- occlusion ------------------------------------------------------------------------------------------- */

/* The depth of the vertex stage for z / w. */
static inline double depth_of_ndc(const tl_cluster_view *v, double z) { return v->zero_to_one ? z : (z + 1.0) * 0.5; }

/* Whether the centre of a box is nearer than the depth there: the box is then not occluded.  A cheap test. */
static inline int shows_middle(const seen_box *box, const tl_cluster_view *v, const tl_window *window,
                               const tl_target *target)
{
    const double inverse = 1.0 / box->f[3].centre;
    const double x_px = (box->f[0].centre * inverse + 1.0) * v->half_width_px - (double)window->x_px;
    const double y_px = (1.0 - box->f[1].centre * inverse) * v->half_height_px - (double)window->y_px;
    if (!(x_px >= 0.0 && x_px < (double)window->width && y_px >= 0.0 && y_px < (double)window->height))
        return 0;
    const double z = depth_of_ndc(v, box->f[2].centre * inverse);
    const double there = target->depth[(int64_t)y_px * target->stride_px + (int64_t)x_px];
    return target->sink == TL_SINK_FARTHEST ? there < z : there > z;
}

/* Whether all of a box is behind the depths of the window; 0 if it covers more than most_px pixels. */
static int is_hidden(const seen_box *box, const tl_cluster_view *v, const tl_window *window, const tl_target *target,
                     int64_t most_px)
{
    const int is_farthest = target->sink == TL_SINK_FARTHEST;
    if (shows_middle(box, v, window, target))
        return 0;
    unsigned within = 0xf;
    double corner[4][8], inverse[8], low[3], high[3], largest[3];
    if (is_outside(box, v, &within) || (within & TL_IN_DEPTH) != TL_IN_DEPTH)
        return 0;
    for (int i = 0; i < 4; i++) {
        const double *row = v->matrix + 4 * i;
        for (int k = 0; k < 8; k++)
            corner[i][k] = box->f[i].centre +
                           (((k & 1 ? row[0] : -row[0]) * box->half[0] + (k & 2 ? row[1] : -row[1]) * box->half[1]) +
                            (k & 4 ? row[2] : -row[2]) * box->half[2]);
    }
    const double w_min = box->f[3].centre - box->f[3].reach - v->error * box->f[3].terms;
    if (!(w_min > 0.0))
        return 0;
    for (int k = 0; k < 8; k++)
        inverse[k] = 1.0 / corner[3][k];
    for (int i = 0; i < 3; i++) { /* a quotient of two forms is largest and least at corners */
        low[i] = INFINITY, high[i] = -INFINITY;
        for (int k = 0; k < 8; k++) {
            const double q = corner[i][k] * inverse[k];
            low[i] = q < low[i] ? q : low[i];
            high[i] = q > high[i] ? q : high[i];
        }
        largest[i] = fmax(fabs(low[i]), fabs(high[i]));
        const double error = 2.0 * v->error * (box->f[i].terms + largest[i] * box->f[3].terms) / w_min;
        low[i] -= error, high[i] += error;
    }
    /* the snap moves it by less than a pixel; doubles up to 2^51 give the right pixel */
    const double left = (low[0] + 1.0) * v->half_width_px - 1.5, right = (high[0] + 1.0) * v->half_width_px + 1.5;
    const double top = (1.0 - high[1]) * v->half_height_px - 1.5, bottom = (1.0 - low[1]) * v->half_height_px + 1.5;
    if (!(left > -0x1p50 && right < 0x1p50 && top > -0x1p50 && bottom < 0x1p50))
        return 0;
    const int64_t col0 = max64((int64_t)floor(left) - window->x_px, 0);
    const int64_t col1 = min64((int64_t)floor(right) + 1 - window->x_px, window->width);
    const int64_t row0 = max64((int64_t)floor(top) - window->y_px, 0);
    const int64_t row1 = min64((int64_t)floor(bottom) + 1 - window->y_px, window->height);
    if ((col1 - col0) * (row1 - row0) > most_px)
        return 0;
    /* docs/design/rules.md: the error of a depth before it is rounded to float32 */
    const double error = 0x1p-33 * (largest[2] + 1.0), z = depth_of_ndc(v, is_farthest ? high[2] : low[2]);
    if (!(fabs(z) < 0x1p126)) /* the vertex stage clamps depths to the largest float32 */
        return 0;
    return all_beat(target->depth, target->stride_px, target->bounds, row0, row1, col0, col1,
                    (float)(is_farthest ? z + error : z - error), is_farthest);
}

#define TL_MAX_PX_OF_CULLED 1024 /* culling the triangles costs no more than testing so many pixels */

static int is_cluster_hidden(const tl_cluster *c, const tl_cluster_view *v, const tl_window *window,
                             const tl_target *target)
{
    const seen_box box = place_box(c->low, c->high, v->matrix);
    const int is_culled_later = v->cull != TL_CULL_NONE && shows_back(c, v, &box);
    return is_hidden(&box, v, window, target, is_culled_later ? TL_MAX_PX_OF_CULLED : INT64_MAX);
}

/* ---- the order of drawing ------------------------------------------------------------------------------------ */

#define TL_SLABS 16 /* of depth; clusters of a slab keep their order */

typedef struct {
    int32_t cluster;
    float depth; /* w, or z without perspective */
} found_cluster;

static inline int slab_of(float depth, float low, float scale)
{
    const float at = (depth - low) * scale;
    return at > 0.0f ? (int)(at < (float)(TL_SLABS - 1) ? at : (float)(TL_SLABS - 1)) : 0;
}

/* z / w of the centre of a cluster. */
static double depth_of(const tl_cluster *c, const double *matrix)
{
    const seen_box box = place_box(c->low, c->high, matrix);
    return box.f[2].centre / box.f[3].centre;
}

/* Sorts the clusters in `found` into slabs of depth; clusters seen from behind have inverted numbers and come last. */
static void sort_by_depth(const tl_clustered *mesh, const tl_cluster_view *v, const found_cluster *found, int64_t n,
                          int32_t *list)
{
    int64_t starts[2 * TL_SLABS + 1] = {0};
    int64_t nearest = 0, farthest = 0;
    for (int64_t i = 0; i < n; i++) {
        nearest = found[i].depth < found[nearest].depth ? i : nearest;
        farthest = found[i].depth > found[farthest].depth ? i : farthest;
    }
    const float low = found[nearest].depth, range = found[farthest].depth - low;
    const float scale = range > 0.0f ? TL_SLABS / range : 0.0f;
    const int32_t a = found[nearest].cluster, b = found[farthest].cluster;
    const double depth_a = depth_of(mesh->clusters + (a < 0 ? ~a : a), v->matrix);
    const double depth_b = depth_of(mesh->clusters + (b < 0 ? ~b : b), v->matrix);
    const int is_upside_down = (depth_b < depth_a) != v->is_farthest;
    for (int pass = 0; pass < 2; pass++) {
        for (int64_t i = 0; i < n; i++) {
            const int is_back = found[i].cluster < 0, slab = slab_of(found[i].depth, low, scale);
            const int at = (is_back ? TL_SLABS : 0) + (is_upside_down ? TL_SLABS - 1 - slab : slab);
            if (pass)
                list[starts[at]++] = is_back ? ~found[i].cluster : found[i].cluster;
            else
                starts[at + 1]++;
        }
        for (int k = 0; !pass && k < 2 * TL_SLABS; k++)
            starts[k + 1] += starts[k];
    }
}

/* The visibility of a cluster: OUTSIDE, CULLED, or else FRONT.  `within`: the sides that its group is within. */
TL_INLINE tl_visibility visibility_of(const tl_cluster *c, const tl_cluster_view *v, const seen_box *box,
                                      unsigned within)
{
    if (is_outside(box, v, &within))
        return TL_VISIBILITY_OUTSIDE;
    if ((within & TL_IN_DEPTH) != TL_IN_DEPTH)
        return TL_VISIBILITY_FRONT;
    return is_between_samples(box, v)                             ? TL_VISIBILITY_OUTSIDE
           : v->cull != TL_CULL_NONE && is_turned_away(c, v, box) ? TL_VISIBILITY_CULLED
                                                                  : TL_VISIBILITY_FRONT;
}

/* Lists the clusters that may draw something, roughly by depth, those seen from behind last.  With a target of depths
 * skips occluded groups.  `room` has 8 bytes for each cluster.  Returns how many. */
static int64_t cull_clusters(const tl_clustered *mesh, const tl_cluster_view *v, const tl_window *window,
                             const tl_target *target, int32_t *list, void *room)
{
    found_cluster *found = room;
    const double *row_w = v->matrix + 12;
    const int has_perspective = row_w[0] != 0.0 || row_w[1] != 0.0 || row_w[2] != 0.0;
    int64_t n = 0;
    for (int64_t first = 0; first < mesh->n_clusters; first += TL_CLUSTER_GROUP) {
        const double *box = mesh->group_boxes + 6 * (first / TL_CLUSTER_GROUP);
        const seen_box group = place_box(box, box + 3, v->matrix);
        unsigned within_group = 0;
        if (is_outside(&group, v, &within_group) || (target && is_hidden(&group, v, window, target, INT64_MAX)))
            continue;
        const int64_t end = first + TL_CLUSTER_GROUP < mesh->n_clusters ? first + TL_CLUSTER_GROUP : mesh->n_clusters;
        for (int64_t i = first; i < end; i++) {
            const tl_cluster *c = mesh->clusters + i;
            const seen_box own = place_box(c->low, c->high, v->matrix);
            if (visibility_of(c, v, &own, within_group) != TL_VISIBILITY_FRONT)
                continue;
            const int32_t number = (int32_t)i;
            found[n++] = (found_cluster){shows_back(c, v, &own) ? ~number : number,
                                         (float)own.f[has_perspective ? 3 : 2].centre};
        }
    }
    if (n)
        sort_by_depth(mesh, v, found, n, list);
    return n;
}

static void survey_clusters(const tl_clustered *mesh, const tl_cluster_view *v, int64_t step,
                            int64_t n_of[TL_N_VISIBILITIES])
{
    memset(n_of, 0, TL_N_VISIBILITIES * sizeof *n_of);
    for (int64_t i = 0; i < mesh->n_clusters; i += step) {
        const tl_cluster *c = mesh->clusters + i;
        const seen_box box = place_box(c->low, c->high, v->matrix);
        const tl_visibility seen = visibility_of(c, v, &box, 0);
        const int is_back = seen == TL_VISIBILITY_FRONT && c->cone_cos > 0.0 && shows_back(c, v, &box);
        n_of[is_back ? TL_VISIBILITY_BACK : seen]++;
    }
}

static void find_shown(const tl_cluster_view *view, const double *boxes, const double *matrices, int64_t n,
                       const tl_window *window, const tl_target *target, uint8_t *shown)
{
    tl_cluster_view own = *view;
    for (int64_t i = 0; i < n; i++) {
        memcpy(own.matrix, matrices + 16 * i, sizeof own.matrix);
        const seen_box box = place_box(boxes + 6 * i, boxes + 6 * i + 3, own.matrix);
        unsigned within = 0;
        shown[i] = !is_outside(&box, &own, &within) &&
                   !((within & TL_IN_DEPTH) == TL_IN_DEPTH && is_between_samples(&box, &own)) &&
                   !(target && is_hidden(&box, &own, window, target, INT64_MAX));
    }
}

/* A cluster as a mesh. */
typedef struct {
    tl_snapped snapped;
    tl_vertex vertices[TL_CLUSTER + TL_CLUSTER_TAIL];
    int32_t corners[3 * (TL_CLUSTER + TL_MAX_LANES)];
    int32_t names[TL_CLUSTER];
} cluster_mesh;

/* Lists the triangles with a special corner in slice->outside and removes them; returns the number that remain. */
static __attribute__((noinline)) int64_t list_special(cluster_mesh *own, int64_t n, tl_slice *slice)
{
    int64_t n_left = 0;
    for (int64_t i = 0; i < n; i++) {
        int32_t *corners = own->corners + 3 * i;
        int is_special = 0;
        for (int k = 0; k < 3; k++)
            is_special |= own->vertices[corners[k]].x_fx == TL_SPECIAL;
        const int32_t name = own->snapped.names[i];
        if (is_special) {
            slice->outside[slice->n_outside++] = name;
            continue;
        }
        memmove(own->corners + 3 * n_left, corners, 3 * sizeof *corners);
        own->names[n_left++] = name;
    }
    own->snapped.names = own->names;
    return n_left;
}

/* Snaps the vertices of a cluster and unpacks its triangles; returns how many triangles to draw. */
static int64_t load_cluster(const tl_cluster *c, const tl_cluster_pass *pass, const tl_snapped *snapped,
                            tl_slice *slice, cluster_mesh *own)
{
    const uint8_t *corners = pass->mesh->corners + 3 * c->first_triangle;
    const size_t row_bytes =
        (size_t)pass->source->n_components * (pass->source->scalar == TL_F32 ? sizeof(float) : sizeof(double));
    tl_source source = *pass->source;
    source.data = (const char *)source.data + (size_t)c->first_vertex * row_bytes;
    source.n -= c->first_vertex;
    /* whole vectors: also snaps vertices of the next cluster, which nothing reads */
    const int64_t n = ((int64_t)c->n_vertices + TL_LANES - 1) / TL_LANES * TL_LANES;
    const tl_vertex_counts counts = project(&source, 0, n, pass->view, &(tl_projected){.records = own->vertices});
    own->snapped = *snapped;
    own->snapped.mesh.vertices = own->vertices;
    own->snapped.mesh.n_vertices = TL_CLUSTER;
    own->snapped.triangles = own->corners;
    own->snapped.n_triangles = c->n_triangles;
    own->snapped.names = pass->mesh->names + c->first_triangle;
    for (int i = 0; i < 3 * c->n_triangles; i++)
        own->corners[i] = corners[i];
    memset(own->corners + 3 * c->n_triangles, 0, 3 * TL_LANES * sizeof *own->corners);
    return counts.n_bad || counts.n_wide || counts.n_clipped ? list_special(own, c->n_triangles, slice)
                                                             : c->n_triangles;
}

/* Lists the clusters that a pass draws unless `is_cluster_hidden`. */
static int64_t list_clusters(tl_cluster_pass *pass, const tl_window *window, const tl_target *target)
{
    pass->n_drawn = 0;
    pass->n_seen =
        cull_clusters(pass->mesh, pass->seen, window, pass->may_be_hidden ? target : NULL, pass->list, pass->room);
    return pass->n_seen;
}

#endif
