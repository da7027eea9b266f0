"""A scheduler or a worker of Dask in a process of its own, which a test may kill: `dask_processes.py scheduler 8786`.

A worker that has lost its scheduler waits for another one at that address, as one does that a service keeps alive.
"""

import asyncio
import logging
import sys


async def serve_scheduler(port: int) -> None:
    """Schedule until the process is killed."""
    from distributed import Scheduler

    async with Scheduler(host="127.0.0.1", port=port, dashboard=False) as scheduler:
        print("ready", flush=True)
        await scheduler.finished()


async def serve_worker(port: int) -> None:
    """Work until the process is killed."""
    from distributed import Worker

    while True:
        try:
            async with Worker(f"tcp://127.0.0.1:{port}", nthreads=1, dashboard=False, death_timeout=30) as worker:
                await worker.finished()
        except (OSError, TimeoutError, asyncio.CancelledError):
            await asyncio.sleep(0.1)


if __name__ == "__main__":
    logging.disable()
    asyncio.run({"scheduler": serve_scheduler, "worker": serve_worker}[sys.argv[1]](int(sys.argv[2])))
