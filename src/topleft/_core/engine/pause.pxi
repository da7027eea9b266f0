# Ctrl-C while a kernel draws, and how a thread stops the others that draw for it. Included by kernels.pyx.

cdef extern from *:
    """
    #include "topleft.h"

    /* How a thread finds out that it is to stop. */
    typedef struct {
        tl_pause pause; /* the first: a pointer to it is one to all */
        const int32_t *stop; /* a flag of the thread that it draws for, or NULL */
        int64_t polled_ns;
        int is_given_up;
    } tl_thread_pause;

    static tl_thread_pause *own_pause(void)
    {
        static _Thread_local tl_thread_pause own;
        return &own;
    }

    static int flag_is_set(const int32_t *stop) { return __atomic_load_n(stop, __ATOMIC_RELAXED); }
    static void set_flag(int32_t *stop) { __atomic_store_n(stop, 1, __ATOMIC_RELAXED); }

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
        int64_t polled_ns
        int is_given_up
    tl_thread_pause *own_pause() noexcept nogil
    bint flag_is_set(const int32_t *stop) noexcept nogil
    void set_flag(int32_t *stop) noexcept nogil
    int64_t clock_ns() noexcept nogil

cdef extern from "Python.h":
    int PyErr_CheckSignals() except -1
    unsigned long PyThread_get_thread_ident() noexcept nogil

cdef enum:
    POLL_AFTER_PX = 1 << 22  # 1 to 40 ms of drawing, after which the clock is read
    SIGNALS_AFTER_NS = 50000000  # the least time between two checks, which take the GIL

cdef unsigned long main_thread = 0
cdef object scratch = None
cdef object pending_error = None


cdef class Stop:
    """Cancels the threads that draw parts of a picture."""

    cdef int32_t is_set

    def set(self):
        """Cancel them."""
        set_flag(&self.is_set)

    def run(self, work: Callable[[], object]):
        """Call `work` in a thread that can be cancelled, which raises KeyboardInterrupt."""
        cdef tl_thread_pause *own = own_pause()
        cdef const int32_t *before = own.stop
        own.stop = &self.is_set
        try:
            work()
        finally:
            own.stop = before


def handle_signals_in(unsigned long thread, threads: object) -> None:
    """Name the main thread, and where each has `kept` its scratch, which a signal handler that draws must not touch."""
    global main_thread, scratch
    main_thread, scratch = thread, threads


cdef tl_pause *pause_of_thread() noexcept nogil:
    cdef tl_thread_pause *own = own_pause()
    if own.pause.poll == NULL:
        own.pause.poll = poll
    return &own.pause


cdef int poll(tl_pause *pause) noexcept nogil:
    """Tell whether to give up: a signal handler has raised, or the flag is set."""
    cdef tl_thread_pause *own = <tl_thread_pause *>pause
    cdef int64_t now
    pause.left_px = POLL_AFTER_PX
    if own.is_given_up:
        pause.left_px = 0
    elif own.stop != NULL:
        own.is_given_up = flag_is_set(own.stop)
    elif PyThread_get_thread_ident() == main_thread:
        now = clock_ns()
        if now - own.polled_ns >= SIGNALS_AFTER_NS:
            own.polled_ns = now
            own.is_given_up = check_signals()
    if own.is_given_up:
        pause.left_px = 0  # the next poll says so at once
    return own.is_given_up


cdef int check_signals() noexcept with gil:
    """Run the handlers of pending signals; returns whether one has raised."""
    global pending_error
    kept = None
    try:
        kept, scratch.kept = getattr(scratch, "kept", None), None  # no Python code, or the handlers would run before
        PyErr_CheckSignals()
    except BaseException as error:
        pending_error = error
    finally:
        scratch.kept = kept
    return pending_error is not None


cdef int raise_if_given_up() except -1:
    """Raise the error for which a kernel of this thread has given up, if one has."""
    global pending_error
    cdef tl_thread_pause *own = own_pause()
    if not own.is_given_up:
        return 0
    own.is_given_up, own.pause.left_px = 0, POLL_AFTER_PX
    if own.stop != NULL:
        raise KeyboardInterrupt
    error, pending_error = pending_error, None  # only the main thread checks signals
    raise error
