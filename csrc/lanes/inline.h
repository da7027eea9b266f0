/* How the functions of the lanes are declared, and how many lanes there are at most. */
#ifndef TL_INLINE_H
#define TL_INLINE_H

#define TL_INLINE static inline __attribute__((always_inline))
#define TL_MAX_LANES 16

#endif
