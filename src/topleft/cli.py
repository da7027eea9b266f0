"""The command line: `topleft render`, `mask`, `raster`, `explore`, `explain`, `calibrate`, `doctor` and `info`."""

from topleft._apps.cli import main

__all__ = ["main"]
