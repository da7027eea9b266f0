"""What workers of a test's cluster do: cameras that wait, kill their process, or hang."""

import os
import signal
import time
from pathlib import Path

import topleft as tl


def kill_once(flag, mesh, size):
    """A camera that kills its worker the first time that it is asked for."""
    path = Path(flag)
    if not path.exists():
        path.write_text(str(os.getpid()))
        os.kill(os.getpid(), signal.SIGKILL)
    return tl.Camera.framing(mesh, aspect=size[0] / size[1])


def kill_always(mesh, size):
    """A camera that kills each worker that asks for it."""
    os.kill(os.getpid(), signal.SIGKILL)


def hang(mesh, size):
    """A camera that never comes."""
    while True:
        time.sleep(0.01)


def wait_a_little(mesh, size):
    """A camera that takes its time."""
    time.sleep(0.05)
    return tl.Camera.framing(mesh, aspect=size[0] / size[1])
