import numpy as np
from numpy.typing import NDArray

FORMS: dict[str, tuple[str, ...]]

def draw(
    method: str,
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int32],
    pixels: NDArray[np.uint8],
    window: tuple[int, int, int, int],
    sink: int,
    variant: str = "",
    subpixel_bits: int = 8,
) -> None: ...
def list_kinds() -> list[tuple[str, str, bool, list[tuple[str, int]]]]: ...
def trace(
    method: str,
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int32],
    counts: NDArray[np.int32],
    window: tuple[int, int, int, int],
    words: NDArray[np.int64],
    subpixel_bits: int = 8,
) -> int: ...
def line_pixels(x0: int, y0: int, x1: int, y1: int) -> NDArray[np.int64]: ...
