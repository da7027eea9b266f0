/* How functions are declared: in lanes and inner loops, compiled into each caller; and what is long or rare, compiled
 * once, whatever constants it is called with.  And how many lanes there are at most. */
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
