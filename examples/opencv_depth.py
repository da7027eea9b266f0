"""Depth and id map of a calibrated camera: intrinsics, pose and distortion as `cv2.calibrateCamera` returns them.

To lay a model over a photograph, or for data sets whose depth has no holes: metric z per pixel, and triangle ids.
"""

import numpy as np
from picture import beside, output_path, ramp

import topleft as tl

SIZE = (320, 240)
INTRINSICS = np.array([[260.0, 0, 161.3], [0, 261.5, 118.7], [0, 0, 1]])
DISTORTION = (-0.31, 0.11, 0.0012, -0.0009, -0.02)  # k1, k2, p1, p2, k3
# Camera from world: x right, y down, z forward.
POSE = np.array([[1, 0, 0, -0.15], [0, -0.906, 0.423, 0.1], [0, -0.423, -0.906, 3.4], [0, 0, 0, 1.0]])


def main() -> None:
    path = output_path(__doc__)
    knot, triangles = tl.scenes.shape("torus-knot", segments=300, sections=24)
    knot = knot / np.abs(knot).max()
    # A floor of two large triangles, whose edges the lens bends.
    floor = np.array([[-3, -1.1, -3], [3, -1.1, -3], [3, -1.1, 3], [-3, -1.1, 3.0]])
    mesh = tl.Mesh(np.vstack([knot, floor]), np.vstack([triangles, len(knot) + np.array([[0, 2, 1], [0, 3, 2]])]))

    camera = tl.Camera.from_intrinsics(INTRINSICS, POSE, SIZE, near=0.1, far=20, distortion=DISTORTION)
    layers = tl.render_layers(mesh, camera, SIZE, layers=("distance", "triangle"))
    z = np.where(np.isfinite(layers["distance"]), layers["distance"], np.nan)  # metres along the axis
    n_seen = len(np.unique(layers["triangle"])) - 1
    print(f"z from {np.nanmin(z):.3f} to {np.nanmax(z):.3f} m, {n_seen} triangles seen")
    ids = tl.render(mesh, camera, SIZE, shading="ids")
    tl.save_image(path, beside(ramp(-z), ids))


if __name__ == "__main__":
    main()
