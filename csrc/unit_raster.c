/* A unit: vertices and triangles to covered samples, exact areas, points and lines; windows of huge rasters; the alpha
 * test, which draws triangle by triangle. */
#include "topleft.h"

#include "vertex/clip.c"
#include "vertex/project.c"
#include "vertex/snap.c"
#include "clusters/cluster_sort.c"
#include "clusters/cluster_view.c"
#include "clusters/mark.c"
#include "exact/pieces.c"
#include "exact/take_points.c"
#include "raster/bin.c"
#include "raster/sides.c"
#include "raster/raster.c"
#include "area/area.c"
#include "points/cloud.c"
#include "lines/edges.c"
#include "lines/lines.c"
#include "tiles/corners.c"
#include "tiles/spans.c"
#include "shade/alpha_test.c"

#include "unit.h"
