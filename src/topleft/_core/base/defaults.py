"""Defaults, limits and formats that the library shares with its applications and its command line."""

DEFAULT_SIZE = (640, 480)
"""Pixels of a picture, (width, height)."""

DEFAULT_FOV_Y_DEG = 40.0
"""From the bottom to the top of a picture."""

THREE_QUARTER_DEG = (35.0, 20.0)
"""Azimuth and elevation of the three-quarter view: front, right side and top all show."""

DEFAULT_CREASE = 30.0
"""Degrees by which triangles of a mesh without normals bend at an edge before it is sharp: round things of 12 sides and
more stay round."""

DEFAULT_POINT_SIZE = 2.0
"""Diameter of a point, pixels."""

MAX_CROSSINGS = 50_000_000
"""How often rings may cross where areas are exact: 4 s of one core."""

PICTURE_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".tif", ".tiff")
BUFFER_SUFFIXES = (".npy", ".npz")
SUFFIXES = PICTURE_SUFFIXES + BUFFER_SUFFIXES
"""Formats that `save_image` writes, by the end of the name."""
