/* A unit: colours in painter's order. */
#include "topleft.h"

#include "blend/blend.c"
#include "blend/fill_shapes.c"

#include "unit.h"
