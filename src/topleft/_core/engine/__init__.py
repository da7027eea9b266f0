"""The compiled unit, and the choice of its instruction set. It allocates scratch, calls csrc and returns its status.

kernels.pyi, which the build makes, has the types of kernels.pyx.
"""

from topleft._core.engine.kernels import *  # noqa: F403
