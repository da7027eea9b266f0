"""Lists what a page may ask, and answers it: a mistake is answered by a sentence.

A part of the page has a file of its own with its `HANDLERS`, by the words that its questions begin with.
"""

from __future__ import annotations

import sys
import traceback
from typing import Any

from topleft._apps.explore import export, mesh_view, pixels, probe, race, trace
from topleft._apps.explore.content import SCENES, scene, scene_groups
from topleft._apps.explore.session import Handler, Reply, Request, Session
from topleft.errors import TopleftError


def hello(session: Session, _: Request) -> Reply:
    """What the page starts with."""
    content = session.content
    given = content.pixels or {**scene(SCENES[0]), "scene": SCENES[0]}
    return Reply(
        {
            "tab": content.tab,
            "name": content.name,
            "fragment": content.fragment,
            "pixels": given,
            "scenes": SCENES,
            "groups": scene_groups(),
            "methods": pixels.methods(),
        }
    )


HANDLERS: dict[str, Handler] = {
    "hello": hello,
    **pixels.HANDLERS,
    **probe.HANDLERS,
    **export.HANDLERS,
    **trace.HANDLERS,
    **mesh_view.HANDLERS,
    **race.HANDLERS,
}
"""By what a page says in "do"."""


def answer(session: Session, request: Request) -> Reply:
    """Return what a page gets for a question: its answer, or the sentence that says what is wrong with it."""
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
    except Exception as error:  # a fault of ours: the page says so, the terminal where
        traceback.print_exc(file=sys.stderr)
        return Reply({**header, "error": f"a fault of the explorer, see the terminal: {sentence(error)}"})
    return Reply({**reply.header, **header}, reply.arrays)


def sentence(error: BaseException) -> str:
    """One line of what an error says."""
    told: Any = str(error) or "not enough memory" if isinstance(error, MemoryError) else str(error)
    return " ".join((told or type(error).__name__).split())[:400]
