import numpy as np
from numpy.typing import NDArray

FORMS: tuple[str, ...]

def draw(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int32],
    pixels: NDArray[np.uint8],
    window: tuple[int, int, int, int],
    sink: int,
    variant: str = "",
    subpixel_bits: int = 8,
) -> None: ...
