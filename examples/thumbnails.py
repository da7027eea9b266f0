"""Thumbnails of all meshes in a folder, on one sheet. Without `--folder` it makes a folder of shapes first.

`python thumbnails.py -o sheet.png --folder ~/meshes`
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

import topleft as tl

SIDE, COLUMNS = 128, 4


def write_shapes(folder: Path) -> None:
    """OBJ files of the built-in shapes."""
    for name in ("cube", "icosahedron", "icosphere", "octahedron", "blob", "tetrahedron", "torus", "torus-knot"):
        vertices, triangles = tl.scenes.shape(name)
        lines = [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in vertices]
        lines += [f"f {a} {b} {c}" for a, b, c in triangles + 1]
        folder.joinpath(f"{name}.obj").write_text("\n".join(lines) + "\n")


def sheet_of(folder: Path) -> np.ndarray:
    """All meshes of a folder, in the order of their names."""
    pictures = []
    for path in sorted(folder.glob("*.obj")):
        mesh = tl.load(path)
        camera = tl.Camera.framing(mesh, fit="points")
        large = tl.render(mesh, camera, (3 * SIDE, 3 * SIDE), background=(244, 244, 246))
        small = large[..., :3].reshape(SIDE, 3, SIDE, 3, 3).mean(axis=(1, 3))  # nine samples a pixel
        pictures.append(np.rint(small).astype(np.uint8))
        print(f"{path.name}: {len(mesh.triangles)} triangles")
    blank = np.full((SIDE, SIDE, 3), 244, np.uint8)
    pictures += [blank] * (-len(pictures) % COLUMNS)
    return np.vstack([np.hstack(pictures[i : i + COLUMNS]) for i in range(0, len(pictures), COLUMNS)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="the picture to write, PNG")
    parser.add_argument("--folder", type=Path, help="where the OBJ files are")
    options = parser.parse_args()
    if options.folder:
        tl.save_image(options.output, sheet_of(options.folder))
        return
    with tempfile.TemporaryDirectory() as folder:
        write_shapes(Path(folder))
        tl.save_image(options.output, sheet_of(Path(folder)))


if __name__ == "__main__":
    main()
