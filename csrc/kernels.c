/* The kernel table of one instruction set: every stage, compiled together, with nothing visible but the table.
 * isa_*.c name the set (TL_ISA_NAME) and the table (TL_KERNELS) and include this file. */
#include "topleft.h"

#include "snap.c"
#include "project.c"
#include "clip.c"
#include "setup.c"
#include "covered.c"
#include "samples.c"
#include "sink.c"
#include "raster.c"
#include "bin.c"
#include "ramp.c"
#include "ramp_exact.c"
#include "accumulate.c"
#include "area.c"
#include "resolve.c"
#include "paint.c"
#include "flat.c"
#include "clusters.c"
#include "edges.c"
#include "line_ends.c"
#include "smooth_lines.c"
#include "lines.c"
#include "mean.c"
#include "composite.c"
#include "shade_runs.c"
#include "shade_texture.c"
#include "shade_light.c"
#include "shade_pixels.c"
#include "shade_srgb.c"
#include "shade_grey.c"
#include "shade.c"
#include "shade_samples.c"
#include "shade_cutout.c"
#include "weights.c"
#include "points.c"
#include "shade_normals.c"
#include "planes.c"
#include "directions.c"
#include "faces.c"
#include "nearest.c"
#include "reach.c"
#include "mix.h"
#include "mix_u8.c"
#include "mix_f32.c"
#include "mix.c"
#include "blend_strip.c"
#include "blend_area.c"
#include "blend.c"

const tl_kernels TL_KERNELS = {
    .isa = TL_ISA_NAME,
    .snap = snap,
    .project = project,
    .clip = clip,
    .first_bad = first_bad,
    .first_bad_row = first_bad_row,
    .narrow_triangles = narrow_triangles,
    .draw = draw,
    .count_classes = count_classes,
    .set_flat_depth = set_flat_depth,
    .bin = bin,
    .list_bins = list_bins,
    .draw_area = draw_area,
    .blend = blend,
    .inverse_w = inverse_ws,
    .barycentric = barycentric,
    .interpolate = interpolate,
    .paint_flat = paint_flat,
    .paint_gouraud = paint_gouraud,
    .place_on_curve = place_on_curve,
    .sort_keys = sort_keys,
    .cut_clusters = cut_clusters,
    .measure_clusters = measure_clusters,
    .survey_clusters = survey_clusters,
    .list_edges = list_edges,
    .draw_lines = draw_lines,
    .composite = composite,
    .set_inverse_w = set_inverse_w,
    .shade = shade,
    .shade_normals = shade_normals,
    .fill_points = fill_points,
    .shade_samples = shade_samples,
    .cut_out = cut_out,
    .mean_flat = mean_flat,
    .mean_colors = mean_colors,
    .list_planes = list_planes,
    .fill_planes = fill_planes,
    .vertex_normals = vertex_normals,
    .face_normals = face_normals,
    .find_turned = find_turned,
    .box_of_faces = box_of_faces,
    .unit_vectors = unit_vectors,
    .move_points = move_points,
    .color_rows = color_rows,
    .build_tree = build_tree,
    .find_nearest = nearest_of_points,
    .find_reach = find_reach,
    .set_feet = set_feet,
};
