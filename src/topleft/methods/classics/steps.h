/* The steps of a method as numbers, for a page that plays them: defines CLASSIC_STEP before it includes classics.h.
 *
 * In: the steps of a method.  Out: a stream of int64 words, a step after the other: kind, triangle, x, y, last, is drawn, then
 * the numbers that the kind lists, two words each, low and high half (a real number: its bits, and 0).  x and last are
 * cut to the window and count from its corner; steps outside are left out. */
#ifndef CLASSIC_STEPS_H
#define CLASSIC_STEPS_H

#include <stdint.h>
#include <string.h>

#include "base/integers.h"
#include "trace.h"

/* Kinds, in the order of CLASSIC_KINDS. */
enum {
    CLASSIC_SPAN,
    CLASSIC_SET_UP,
    CLASSIC_SET_UP_AREA,
    CLASSIC_SET_UP_REAL,
    CLASSIC_SET_UP_EDGES,
    CLASSIC_SET_UP_WALK,
    CLASSIC_TEST,
    CLASSIC_TEST_WAY,
    CLASSIC_TEST_REAL,
    CLASSIC_TEST_WALK,
    CLASSIC_ROW_LERP,
    CLASSIC_ROW_CROSSING,
    CLASSIC_ROW_LINES,
    CLASSIC_LEFT_LINE,
    CLASSIC_RIGHT_LINE,
    CLASSIC_ROW_ENDS /* of all three edges; then without the first, the second, the third, which is horizontal */
};

#define CORNERS "a:2,b:2,c:2"
const classic_kind CLASSIC_KINDS[] = {
    {"span", "", 0, "", 0},
    {"triangle", "", 0, CORNERS, 6},
    {"triangle", "", 0, CORNERS ",area:1", 7},
    {"triangle", "", 1, CORNERS ",area:1", 7},
    {"triangle", "", 0, CORNERS ",columns:2,rows:2,bias:3,step_x:3,step_y:3", 19},
    {"triangle", "", 0, CORNERS ",columns:2,rows:2,dx:3,dy:3,is_top_left:3", 19},
    {"test", "", 0, "E0:1,E1:1,E2:1", 3},
    {"test", "", 0, "E0:1,E1:1,E2:1,way:1", 4},
    {"test", "", 1, "w0:1,w1:1,w2:1", 3},
    {"test", "", 0, "is_inside:1,E0:1,E1:1,E2:1", 4},
    {"row", "", 0, "long_x:1,short_x:1", 2},
    {"row", "", 1, "ab:1,bc:1,ca:1", 3},
    {"row", "", 0, "left:2,right:2", 4},
    {"line", "left", 0, "error:1", 1},
    {"line", "right", 0, "error:1", 1},
    {"row", "", 0, "first:1,end:1,q0 r0:2,q1 r1:2,q2 r2:2", 8},
    {"row", "", 0, "first:1,end:1,q1 r1:2,q2 r2:2", 6},
    {"row", "", 0, "first:1,end:1,q0 r0:2,q2 r2:2", 6},
    {"row", "", 0, "first:1,end:1,q0 r0:2,q1 r1:2", 6},
    {0},
};

typedef struct classic_trace {
    int64_t *words, *end; /* where the next step goes, and where the room ends */
    int64_t n;            /* steps, whether or not there was room */
} classic_trace;

enum { CLASSIC_STEP_WORDS = 6 };

/* Where the numbers of a step go; NULL where it is left out.  x0, y0, x1, y1 are the window. */
static inline int64_t *note_step(classic_trace *trace, const int64_t *window, int32_t triangle, int kind, int64_t x,
                                 int64_t y, int64_t last, int is_drawn)
{
    const int is_triangle = CLASSIC_KINDS[kind].name[0] == 't' && CLASSIC_KINDS[kind].name[1] == 'r';
    const int is_place = is_triangle || CLASSIC_KINDS[kind].name[0] == 'r'; /* of no pixel */
    if (is_place)
        last = x;
    else {
        x = x > window[0] ? x : window[0];
        last = last < window[2] - 1 ? last : window[2] - 1;
        if (x > last)
            return NULL;
    }
    if (!is_triangle && (y < window[1] || y >= window[3]))
        return NULL;
    const int64_t head[CLASSIC_STEP_WORDS] = {kind, triangle, x - window[0], y - window[1], last - window[0], is_drawn};
    int64_t *numbers = trace->words + CLASSIC_STEP_WORDS;
    trace->n++;
    if (trace->end - trace->words < CLASSIC_STEP_WORDS + 2 * CLASSIC_KINDS[kind].n)
        return NULL;
    memcpy(trace->words, head, sizeof head);
    trace->words = numbers + 2 * CLASSIC_KINDS[kind].n;
    return numbers;
}

/* `put` writes each of the numbers into two words. */
#define NOTE_STEP(type, put, t, kind, x, y, last, is_drawn, ...)                               \
    do {                                                                                       \
        const type given[] = {__VA_ARGS__};                                                    \
        int64_t *to = note_step((t)->trace, &(t)->x0, (t)->label, kind, x, y, last, is_drawn); \
        for (int i_ = 0; to && i_ < CLASSIC_KINDS[kind].n; i_++, to += 2)                      \
            put(to, given[i_]);                                                                \
    } while (0)
#define CLASSIC_STEP(...) NOTE_STEP(int64_t, put_whole, __VA_ARGS__)
#define CLASSIC_REAL_STEP(...) NOTE_STEP(double, put_real, __VA_ARGS__)
#define CLASSIC_WIDE_STEP(...) NOTE_STEP(tl_int128, put_wide, __VA_ARGS__)

static inline void put_whole(int64_t *to, int64_t number) { to[0] = number, to[1] = -(number < 0); }
static inline void put_real(int64_t *to, double number) { memcpy(to, &number, sizeof number), to[1] = 0; }
static inline void put_wide(int64_t *to, tl_int128 number)
{
    to[0] = i128_low(number), to[1] = i128_low(i128_shift_right(number, 64));
}

#endif
