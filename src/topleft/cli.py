"""The command line: `render`, `mask`, `bop`, `bake`, `raster`, `explore`, `explain`, `doctor`, `info`."""

from topleft._apps.cli import main

__all__ = ["main"]
