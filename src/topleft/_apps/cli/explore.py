"""`topleft explore`: a page in the browser, to move triangles and watch their pixels."""

from __future__ import annotations

import argparse
from contextlib import suppress
from pathlib import Path
from typing import Any

from topleft._apps.cli.arguments import UsageError, add_command, size

EXPLORE_HELP = """\
WHAT is a mesh file, an .npz file with arrays `vertices`, `triangles` and maybe `size`, the name of a scene
(two-triangles, far-1e8-gap, torus-knot), or a link that was copied from the page. Without it the page begins with two
triangles.

The page is served to this machine alone, under an address with a token, until it has been closed for half a minute.
--export writes it as a folder instead, for any web server: its kernels run in the browser, without Python.

examples:
  topleft explore two-triangles
  topleft explore bunny.ply
  topleft explore arrays.npz --no-browser
  topleft explore --export site && python -m http.server -d site
"""


def run_explore(options: argparse.Namespace) -> int:
    """Serve the explorer until its page is closed or Ctrl-C is pressed."""
    from topleft._apps.explore.content import content_of_name  # which the other commands do not need
    from topleft._apps.explore.open import open_page

    if not 0 <= options.port < 65536:
        raise UsageError(f"--port must be from 0 to 65535, got {options.port}")
    if not options.idle > 0:
        raise UsageError(f"--idle must be more than 0 seconds, got {options.idle}")
    content = content_of_name(options.what or "shared-edge", options.size)
    if options.export is not None:
        from topleft._apps.explore.static import write_static

        written = write_static(Path(options.export), content)
        print(f"{options.export}: {len(written)} files, {sum(path.stat().st_size for path in written):,} bytes")
        return 0
    host, port, idle, browser = options.host, options.port, options.idle, not options.no_browser
    with suppress(KeyboardInterrupt), open_page(content, host=host, port=port, idle=idle, browser=browser) as explorer:
        explorer.wait()
    return 0


def add_explore_command(commands: Any) -> None:
    """Add the command to the commands of `topleft`."""
    what = "move triangles in the browser and watch their pixels"
    add = add_command(commands, "explore", run_explore, what, EXPLORE_HELP).add_argument
    add("what", nargs="?", metavar="WHAT", help="a file, the name of a scene, or a link")
    add("--size", type=size, metavar="WxH", help="of the magnified picture, for an .npz file")
    add("--no-browser", action="store_true", help="print the address alone")
    add("--export", metavar="DIR", help="write the page there, as files that need no Python")
    add("--port", type=int, default=0, help="a free one unless given")
    add(
        "--host", help="let other machines see the page, too, at this address of this machine; traffic is not encrypted"
    )
    add("--idle", type=float, default=30.0, metavar="SECONDS", help="after the page was closed, until the end: 30")
