/* A unit: tensors of pixels, and gradients. */
#include "topleft.h"

#include "grad/area_vjp.c"
#include "grad/edges.c"
#include "grad/pictures.c"
#include "grad/outline.c"
#include "grad/points.c"
#include "grad/textures.c"
#include "grad/values.c"

#include "unit.h"
