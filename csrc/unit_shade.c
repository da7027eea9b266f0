/* A unit: materials and light. */
#include "topleft.h"

#include "shade/shade.c"
#include "shade/shade_samples.c"

#include "unit.h"
