# Polls for Ctrl-C while a kernel draws, and cancels the threads that draw parts of a picture. Included by kernels.pyx.

cdef extern from *:
    """
    #include "dispatch.h"

    /* The state of a thread from which `poll` decides whether its kernel stops. */
    typedef struct {
        tl_pause pause; /* first: `poll` casts a pointer to it to tl_thread_pause */
        const int32_t *stop; /* the flag of `Stop`, NULL in a thread that no `Stop` runs */
        int64_t polled_ns;
        int is_given_up;
    } tl_thread_pause;

    static tl_thread_pause *state_of_thread(void)
    {
        static _Thread_local tl_thread_pause state;
        return &state;
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
    tl_thread_pause *state_of_thread() noexcept nogil
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
        cdef tl_thread_pause *state = state_of_thread()
        cdef const int32_t *before = state.stop
        state.stop = &self.is_set
        try:
            work()
        finally:
            state.stop = before


def handle_signals_in(unsigned long thread, threads: object) -> None:
    """Set the main thread, and the thread-local object whose `kept` is the scratch that signal handlers must not use."""
    global main_thread, scratch
    main_thread, scratch = thread, threads


cdef tl_pause *pause_of_thread() noexcept nogil:
    cdef tl_thread_pause *state = state_of_thread()
    if state.pause.poll == NULL:
        state.pause.poll = poll
    return &state.pause


cdef int poll(tl_pause *pause) noexcept nogil:
    """Return whether to give up: a signal handler has raised, or the flag is set."""
    cdef tl_thread_pause *state = <tl_thread_pause *>pause
    cdef int64_t now
    pause.left_px = POLL_AFTER_PX
    if state.is_given_up:
        pause.left_px = 0
    elif state.stop != NULL:
        state.is_given_up = flag_is_set(state.stop)
    elif PyThread_get_thread_ident() == main_thread:
        now = clock_ns()
        if now - state.polled_ns >= SIGNALS_AFTER_NS:
            state.polled_ns = now
            state.is_given_up = check_signals()
    if state.is_given_up:
        pause.left_px = 0  # poll again at the next chance
    return state.is_given_up


cdef int check_signals() noexcept with gil:
    """Run the handlers of pending signals; returns whether one has raised."""
    global pending_error
    kept = None
    try:
        kept, scratch.kept = getattr(scratch, "kept", None), None  # not in a Python function, which would run handlers
        PyErr_CheckSignals()
    except BaseException as error:
        pending_error = error
    finally:
        scratch.kept = kept
    return pending_error is not None


cdef int raise_if_given_up() except -1:
    """Raise the error for which a kernel of this thread has given up, if any."""
    global pending_error
    cdef tl_thread_pause *state = state_of_thread()
    if not state.is_given_up:
        return 0
    state.is_given_up, state.pause.left_px = 0, POLL_AFTER_PX
    if state.stop != NULL:
        raise KeyboardInterrupt
    error, pending_error = pending_error, None  # only the main thread checks signals
    raise error
