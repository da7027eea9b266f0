/* A unit: a visibility buffer to weights, values and colours; pixels to run lengths and to PNG. */
#include "topleft.h"

#include "pixels/composite.c"
#include "pixels/instances.c"
#include "pixels/paint.c"
#include "pixels/planes.c"
#include "pixels/png.c"
#include "pixels/points.c"
#include "pixels/resolve.c"
#include "pixels/rle.c"
#include "pixels/slopes.c"
#include "pixels/texels.c"
#include "pixels/weights.c"
#include "pixels/weights_exact.c"
#include "pixels/weights_one.c"

#include "unit.h"
