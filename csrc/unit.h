/* The end of each unit.  The build compiles it with TL_UNIT and TL_ISA, the names of the unit and of the set: it then
 * defines one function, which stores the unit's kernels in a table, and no other symbol, so that no code of a wider set
 * can replace the baseline's.  Without them it is a part of kernels.c. */
#include "dispatch.h"

#ifdef TL_UNIT
#define TL_JOIN(a, b, c) a##b##c
#define TL_JOINED(a, b, c) TL_JOIN(a, b, c)
#define TL_KERNELS_OF TL_JOINED(TL_UNIT_, TL_UNIT, )

/* A stub where no kernel of this unit draws with the sink of hooks.h. */
#if defined(TL_HOOKS_H) && !defined(TL_FILL_SHAPES_C)
static void mix_run(struct blend_state *b, int64_t at, int64_t n) { (void)b, (void)at, (void)n, __builtin_trap(); }
#endif

void TL_JOINED(tl_set_, TL_UNIT, TL_JOINED(_, TL_ISA, ))(tl_kernels *kernels);
void TL_JOINED(tl_set_, TL_UNIT, TL_JOINED(_, TL_ISA, ))(tl_kernels *kernels)
{
#define TL_KERNEL(result, name, ...) kernels->name = name;
#include "kernels.h"
}
#endif
