"""The page of the explorer without a browser: its functions in node, its engine Python, or the kernels of a site."""

import base64
import json
import shutil
import subprocess
from importlib.resources import files
from pathlib import Path

import numpy as np

from topleft._apps.explore.handlers import answer
from topleft._apps.explore.messages import split
from topleft._apps.explore.session import Content, Session

NODE = shutil.which("node")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
PAGE = files("topleft._apps.explore").joinpath("page")


class NodePage:
    """A page; `site`: the folder that `--export` has written, whose kernels answer in place of Python."""

    def __init__(self, *site):
        command = [NODE, str(Path(__file__).with_name("ask_page.mjs")), str(PAGE), *map(str, site)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.session = Session(Content())

    def close(self):
        self.process.communicate(timeout=60)

    def call(self, module, name, *given, is_hashed=False):
        """What a function of the page returns, its arrays as lists or hashes; ValueError where it throws."""
        self._write({"module": module, "name": name, "given": given, "is_hashed": is_hashed})
        while "ask" in (told := json.loads(self.process.stdout.readline())):
            parts = [memoryview(base64.b64decode(part)) for part in told["parts"]]
            header, bytes_drawn = split(answer(self.session, {**told["ask"], "parts": parts}))
            self._write({"header": header, "parts": [base64.b64encode(part).decode() for part in bytes_drawn]})
        if "error" in told:
            raise ValueError(told["error"])
        return told["result"]

    def draw(self, state):
        """The panels of a state by their keys, with their arrays (H, W) and (H, W, 4), and where samples lie."""
        told = self.call("pixels.js", "drawPixels", state)
        width, height = state["size"]
        for panel in told["panels"]:
            for name in ("owners", "counts", "picture"):
                if name in panel:
                    panel[name] = np.array(panel[name]).reshape(height, width, *((4,) if name == "picture" else ()))
        return {panel["key"]: panel for panel in told["panels"]}, told["samples"]

    def _write(self, message):
        self.process.stdin.write(json.dumps(message) + "\n")
        self.process.stdin.flush()
