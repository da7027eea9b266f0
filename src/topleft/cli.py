"""The command line: `topleft render`, `mask`, `bake`, `raster`, `explore`, `explain`, `calibrate`, `doctor`, `info`."""

from topleft._apps.cli import main

__all__ = ["main"]
