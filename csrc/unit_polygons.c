/* A unit: rings to masks; arrays of meshes; meshes on grids. */
#include "topleft.h"

#include "mesh/bend.c"
#include "mesh/creases.c"
#include "mesh/ears.c"
#include "mesh/equal.c"
#include "mesh/nearest.c"
#include "mesh/normals.c"
#include "mesh/reach.c"
#include "polygons/labels.c"
#include "polygons/mask.c"
#include "polygons/points.c"
#include "polygons/shares.c"
#include "polygons/simple.c"
#include "grid/atlas.c"
#include "grid/voxels.c"

#include "unit.h"
