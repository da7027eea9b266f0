/* How functions are declared: in lanes and inner loops, compiled into each caller; long or rare functions, compiled
 * once, whatever their constant arguments.  Also the most lanes there are. */
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
