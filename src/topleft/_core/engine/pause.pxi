# Ctrl-C while a kernel draws, and how a thread ends what others draw for it. Included by kernels.pyx.

cdef extern from *:
    """
    #include "topleft.h"

    /* What a thread asks while it draws. */
    typedef struct {
        tl_pause pause; /* the first: a pointer to it is one to all */
        const int32_t *stop; /* set by the thread that it draws for, or NULL */
        int64_t asked_ns;
        int is_given_up;
    } tl_thread_pause;

    static tl_thread_pause *own_pause(void)
    {
        static _Thread_local tl_thread_pause own;
        return &own;
    }

    static int is_said(const int32_t *stop) { return __atomic_load_n(stop, __ATOMIC_RELAXED); }
    static void say(int32_t *stop) { __atomic_store_n(stop, 1, __ATOMIC_RELAXED); }

    #ifdef _WIN32
    __declspec(dllimport) unsigned long long __stdcall GetTickCount64(void);
    static int64_t clock_ns(void) { return (int64_t)GetTickCount64() * 1000000; }
    #else
    #include <time.h>
    static int64_t clock_ns(void)
    {
        struct timespec now;
        clock_gettime(CLOCK_MONOTONIC, &now);
        return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
    }
    #endif
    """
    ctypedef struct tl_thread_pause:
        tl_pause pause
        const int32_t *stop
        int64_t asked_ns
        int is_given_up
    tl_thread_pause *own_pause() noexcept nogil
    bint is_said(const int32_t *stop) noexcept nogil
    void say(int32_t *stop) noexcept nogil
    int64_t clock_ns() noexcept nogil

cdef extern from "Python.h":
    int PyErr_CheckSignals() except -1
    unsigned long PyThread_get_thread_ident() noexcept nogil

cdef enum:
    ASK_AFTER_PX = 1 << 22  # 1 to 40 ms of drawing, after which the clock is read
    HEAR_AFTER_NS = 50000000  # the least time between two takings of the GIL

cdef unsigned long main_thread = 0
cdef object scratch = None
cdef object heard = None


cdef class Stop:
    """A word to the threads that draw parts of a picture: give it up."""

    cdef int32_t is_set

    def set(self):
        """Say it."""
        say(&self.is_set)

    def run(self, work: Callable[[], object]):
        """Call `work` in a thread that hears the word; what is given up raises KeyboardInterrupt."""
        cdef tl_thread_pause *own = own_pause()
        cdef const int32_t *before = own.stop
        own.stop = &self.is_set
        try:
            work()
        finally:
            own.stop = before


def hear_signals_in(unsigned long thread, threads: object) -> None:
    """Name the main thread, and where each has `kept` its scratch, which a signal handler that draws must not touch."""
    global main_thread, scratch
    main_thread, scratch = thread, threads


cdef tl_pause *pause_of_thread() noexcept nogil:
    cdef tl_thread_pause *own = own_pause()
    if own.pause.ask == NULL:
        own.pause.ask = ask
    return &own.pause


cdef int ask(tl_pause *pause) noexcept nogil:
    """Tell whether to give up: a handler of a signal has raised, or the thread that is drawn for says so."""
    cdef tl_thread_pause *own = <tl_thread_pause *>pause
    cdef int64_t now
    pause.left_px = ASK_AFTER_PX
    if own.is_given_up:
        pause.left_px = 0
    elif own.stop != NULL:
        own.is_given_up = is_said(own.stop)
    elif PyThread_get_thread_ident() == main_thread:
        now = clock_ns()
        if now - own.asked_ns >= HEAR_AFTER_NS:
            own.asked_ns = now
            own.is_given_up = hear()
    if own.is_given_up:
        pause.left_px = 0  # whoever asks again is told at once
    return own.is_given_up


cdef int hear() noexcept with gil:
    """Run the handlers of the signals that have come; returns whether one has raised."""
    global heard
    kept = None
    try:
        kept, scratch.kept = getattr(scratch, "kept", None), None  # no Python code, or the handlers would run before
        PyErr_CheckSignals()
    except BaseException as error:
        heard = error
    finally:
        scratch.kept = kept
    return heard is not None


cdef int raise_if_given_up() except -1:
    """Raise what made a kernel of this thread give up, if one has."""
    global heard
    cdef tl_thread_pause *own = own_pause()
    if not own.is_given_up:
        return 0
    own.is_given_up, own.pause.left_px = 0, ASK_AFTER_PX
    if own.stop != NULL:
        raise KeyboardInterrupt
    error, heard = heard, None  # the main thread alone hears
    raise error
