import numpy as np
from numpy.typing import NDArray

from topleft.methods import Kernel

FORMS: tuple[str, ...]
draw: Kernel

def line_pixels(x0: int, y0: int, x1: int, y1: int) -> NDArray[np.int64]: ...
