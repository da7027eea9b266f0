/* How functions are declared: in lanes and inner loops, compiled into each caller; and long or rare ones, compiled
 * once, whatever constants they are called with.  And how many lanes there are at most. */
#ifndef TL_INLINE_H
#define TL_INLINE_H

#define TL_INLINE static inline __attribute__((always_inline))
#ifdef __clang__
#define TL_ONCE static __attribute__((noinline))
#else
#define TL_ONCE static __attribute__((noinline, noclone))
#endif
#define TL_MAX_LANES 16

#endif
