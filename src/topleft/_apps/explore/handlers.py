"""Answers the requests of a page; the reply to a wrong request is a sentence.

Each part of the page has a file with its `HANDLERS`, by the name of the request.
"""

from __future__ import annotations

import sys
import traceback
from typing import Any, get_args

import numpy as np

from topleft._apps.explore import engine, export, mesh_view, race
from topleft._apps.explore.content import MAX_SIDE_PX, MAX_TRIANGLES, MAX_VERTICES, SCENES, scene, scene_groups
from topleft._apps.explore.session import Handler, Reply, Request, Session
from topleft.errors import TopleftError
from topleft.methods import CLASSICS, METHODS
from topleft.methods.classics.classic_kernels import list_kinds
from topleft.methods.reference.sampling import SAMPLE_POSITIONS
from topleft.typing import CullOption, DepthTestOption, SamplingOption


def hello(session: Session, _: Request) -> Reply:
    """Return the content, scenes, methods and limits for a page that opens."""
    content = session.content
    pixels = content.pixels or {**scene(SCENES[0]), "scene": SCENES[0]}
    return Reply(
        {
            "tab": content.tab,
            "name": content.name,
            "fragment": content.fragment,
            "pixels": pixels,
            "scenes": SCENES,
            "groups": scene_groups(),
            "methods": methods(),
            "samples": SAMPLE_POSITIONS,
            "kinds": list_kinds(),
            "race": race.lists(),
            "words": {"sampling": get_args(SamplingOption), "cull": get_args(CullOption),
                      "depth_test": get_args(DepthTestOption)},
            "limits": {"max_side_px": MAX_SIDE_PX, "max_triangles": MAX_TRIANGLES, "max_vertices": MAX_VERTICES,
                       "max_steps": engine.MAX_STEPS},
        }
    )  # fmt: skip


def methods() -> list[dict[str, Any]]:
    """All methods, in the order of the page."""
    return [
        {"name": method.name, "summary": method.summary, "source": method.source, "is_classic": method.name in CLASSICS,
         "has_bits": method.has_subpixel_bits, "is_integer": method.claims.integer_vertices}
        for method in (*METHODS.values(), *CLASSICS.values())
    ]  # fmt: skip


def take_scene(_: Session, request: Request) -> Reply:
    """Return a named scene as a state."""
    return Reply({"state": scene(str(request.get("name")))})


def take_vertices(session: Session, request: Request) -> Reply:
    """Store the vertices that a page has moved."""
    vertices = np.array(request["vertices"], np.float64)
    if vertices.size and (vertices.ndim != 2 or vertices.shape[1] not in (2, 3)):
        raise ValueError(f"vertices must have a row of two or three numbers each, got shape {vertices.shape}")
    session.content.moved = vertices if vertices.size else vertices.reshape(0, 2)
    return Reply({})


HANDLERS: dict[str, Handler] = {
    "hello": hello,
    "pixels.scene": take_scene,
    "pixels.moved": take_vertices,
    **engine.HANDLERS,
    **export.HANDLERS,
    **mesh_view.HANDLERS,
    **race.HANDLERS,
}
"""The handlers, by "do" of the request."""


def answer(session: Session, request: Request) -> Reply:
    """Return the reply to a request: of its handler, or a sentence with the error."""
    name, header = request.get("do"), {"id": request.get("id")}
    if not isinstance(header["id"], int):
        return Reply({"id": None, "error": "a question must have a number as its id"})
    if not isinstance(name, str) or name not in HANDLERS:
        return Reply({**header, "error": f"nothing is called {str(name)[:40]!r} here"})
    try:
        reply = HANDLERS[name](session, request)
    except (TopleftError, ValueError, TypeError, IndexError, OSError, MemoryError) as error:
        return Reply({**header, "error": sentence(error)})
    except KeyError as error:
        return Reply({**header, "error": f"the question must hold {error}"})
    except Exception as error:  # a bug: the page shows a sentence, the terminal the traceback
        traceback.print_exc(file=sys.stderr)
        return Reply({**header, "error": f"a fault of the explorer, see the terminal: {sentence(error)}"})
    return Reply({**reply.header, **header}, reply.arrays)


def sentence(error: BaseException) -> str:
    """The message of an error in a line."""
    text: Any = str(error) or "not enough memory" if isinstance(error, MemoryError) else str(error)
    return " ".join((text or type(error).__name__).split())[:400]
