"""Ends batches by a signal at each place where the calling thread has just taken a lock of `concurrent.futures`.

Run as a program: it prints how many places there were, or what every thread does once a batch hangs.
"""

import faulthandler
import signal
import sys
from concurrent.futures import ThreadPoolExecutor
from itertools import count

import topleft as tl

CUBE = tl.Mesh(*tl.scenes.shape("cube"))
HANGS_S = 20
OF_LOCKS = ("acquire", "__enter__")


class Killed(BaseException):
    pass


def kill(*_):
    raise Killed


def batch_ends(make_executor, order, i_place):
    """Draw a batch with a signal at a place; whether there was such a place."""
    n_places = 0

    def at_lock(frame, event, what):
        nonlocal n_places
        of_futures = frame.f_code.co_filename.endswith(("concurrent/futures/_base.py", "threading.py", "queue.py"))
        if event == "c_return" and of_futures and what.__name__ in OF_LOCKS:
            n_places += 1
            if n_places == i_place + 1:
                sys.setprofile(None)
                signal.raise_signal(signal.SIGTERM)

    jobs = [tl.Job(CUBE, size=(8, 8)) for _ in range(6)]
    executor = make_executor()
    try:
        with tl.render_batch(jobs, executor=executor, order=order) as batch:
            sys.setprofile(at_lock)
            for _ in batch:
                pass
    except Killed:
        pass
    finally:
        sys.setprofile(None)
        if executor is not None and not isinstance(executor, int):
            executor.shutdown()
    return n_places > i_place


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, kill)
    n = 0
    for make_executor in (lambda: 2, lambda: ThreadPoolExecutor(2)):
        for order in ("jobs", "completed"):
            for i_place in count():
                faulthandler.dump_traceback_later(HANGS_S, exit=True)
                if not batch_ends(make_executor, order, i_place):
                    break
                n += 1
    faulthandler.cancel_dump_traceback_later()
    print(n, "places")
