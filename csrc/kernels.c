/* The kernel table of one instruction set: every stage, compiled together, with nothing visible but the table.  A stage
 * includes the files it needs; these are the ones that the table names.
 * isa_*.c name the set (TL_ISA_NAME) and the table (TL_KERNELS) and include this file. */
#include "topleft.h"

#include "vertex/clip.c"
#include "vertex/project.c"
#include "vertex/snap.c"
#include "clusters/cluster_sort.c"
#include "clusters/cluster_view.c"
#include "clusters/mark.c"
#include "exact/pieces_exact.c"
#include "exact/take_points.c"
#include "mesh/bend.c"
#include "mesh/creases.c"
#include "mesh/ears.c"
#include "mesh/equal.c"
#include "mesh/nearest.c"
#include "mesh/normals.c"
#include "mesh/reach.c"
#include "raster/bin.c"
#include "raster/sides.c"
#include "large_shapes/large_shapes.c"
#include "area/area.c"
#include "points/cloud.c"
#include "pixels/composite.c"
#include "pixels/instances.c"
#include "pixels/paint.c"
#include "pixels/lay.c"
#include "pixels/planes.c"
#include "pixels/points.c"
#include "pixels/resolve.c"
#include "pixels/rle.c"
#include "pixels/slopes.c"
#include "pixels/split.c"
#include "pixels/texels.c"
#include "pixels/weights.c"
#include "pixels/weights_exact.c"
#include "pixels/weights_one.c"
#include "blend/blend.c"
#include "blend/fill_shapes.c"
#include "grad/area_vjp.c"
#include "grad/colors.c"
#include "grad/edges.c"
#include "grad/pictures.c"
#include "grad/outline.c"
#include "grad/points.c"
#include "grad/textures.c"
#include "grad/values.c"
#include "lines/edges.c"
#include "lines/lines.c"
#include "polygons/labels.c"
#include "polygons/mask.c"
#include "polygons/points.c"
#include "polygons/shares.c"
#include "polygons/simple.c"
#include "shade/alpha_test.c"
#include "shade/shade.c"
#include "shade/shade_samples.c"
#include "grid/atlas.c"
#include "grid/viewshed.c"
#include "grid/voxels.c"
#include "tiles/corners.c"
#include "tiles/merge.c"
#include "tiles/spans.c"

#ifndef TL_KERNELS /* read by itself, as an editor does */
#define TL_ISA_NAME "none"
#define TL_KERNELS tl_kernels_none
#endif

const tl_kernels TL_KERNELS = {
    .isa = TL_ISA_NAME,
    .snap = snap,
    .project = project,
    .clip = clip,
    .first_bad = first_bad,
    .first_bad_row = first_bad_row,
    .narrow_triangles = narrow_triangles,
    .draw = draw_mesh,
    .project_to = project_to,
    .clip_points = clip_points,
    .take_points = take_points,
    .count_classes = count_classes,
    .set_flat_depth = set_flat_depth,
    .bin = bin,
    .list_bins = list_bins,
    .find_columns = find_columns,
    .lay_rows = lay_rows,
    .split_pixels = split_pixels,
    .spread_ids = spread_ids,
    .find_instances = find_instances,
    .list_column_runs = list_column_runs,
    .count_runs = count_runs,
    .write_counts = write_counts,
    .draw_area = draw_area,
    .blend = blend,
    .fill_large_shapes = fill_large_shapes,
    .inverse_w = inverse_ws,
    .barycentric = barycentric,
    .interpolate = interpolate,
    .paint_flat = paint_flat,
    .paint_gouraud = paint_gouraud,
    .mark_vertices = mark_vertices,
    .place_on_curve = place_on_curve,
    .sort_keys = sort_keys,
    .cut_clusters = cut_clusters,
    .measure_clusters = measure_clusters,
    .survey_clusters = survey_clusters,
    .count_hidden = count_hidden,
    .find_shown = find_shown,
    .drop_sides = drop_sides,
    .list_edges = list_edges,
    .draw_lines = draw_lines,
    .draw_cloud = draw_cloud,
    .composite = composite,
    .fill_slopes = fill_slopes,
    .fill_texels = fill_texels,
    .levels_seen = levels_seen,
    .halve_rows = halve_rows,
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
    .face_angles = face_angles,
    .list_corners = list_corners,
    .find_creases = find_creases,
    .sum_creases = sum_creases,
    .cut_faces = cut_faces,
    .box_of_faces = box_of_faces,
    .unit_vectors = unit_vectors,
    .move_points = move_points,
    .color_rows = color_rows,
    .group_rows = group_rows,
    .build_tree = build_tree,
    .find_nearest = nearest_of_points,
    .bend_vertices = bend_vertices,
    .see_points = see_points,
    .find_bent = find_bent,
    .split_bent = split_bent,
    .find_reach = find_reach,
    .set_feet = set_feet,
    .snap_points = snap_points,
    .bound_polygons = bound_polygons,
    .sort_polygons = sort_polygons,
    .certify_polygons = certify_polygons,
    .trust_polygons = trust_polygons,
    .mask_even_odd = mask_even_odd,
    .mask_nonzero = mask_nonzero,
    .label_polygons = label_polygons,
    .share_polygons = share_polygons,
    .list_spans = list_spans,
    .sort_spans = sort_spans,
    .count_windows = count_windows,
    .take_corners = take_corners,
    .merge_fragments = merge_fragments,
    .name_triangles = name_triangles,
    .grad_points = grad_points,
    .grad_points_vjp = grad_points_vjp,
    .grad_values = grad_values,
    .grad_values_vjp = grad_values_vjp,
    .grad_colors_vjp = grad_colors_vjp,
    .grad_texels = grad_texels,
    .grad_texels_vjp = grad_texels_vjp,
    .grad_sides = grad_sides,
    .grad_outline = mark_silhouettes,
    .grad_edges = grad_edges,
    .grad_picture = grad_picture,
    .grad_area = grad_area,
    .touch_texels = touch_texels,
    .average_texels = average_texels,
    .find_in_rows = find_in_rows,
    .find_gutter = find_gutter,
    .copy_texels = copy_texels,
    .add_taken = add_taken,
    .view_heights = view_heights,
    .fill_columns = fill_columns,
    .expand_columns = expand_columns,
    .count_columns = count_columns,
    .scatter_columns = scatter_columns,
    .touch_voxels = touch_voxels,
};
