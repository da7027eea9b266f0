"""A heat map of overdraw: how many triangles of a mesh lie behind each pixel, which is what a renderer pays for."""

import numpy as np
from picture import output_path, ramp

import topleft as tl

SIZE = (480, 270)


def main() -> None:
    path = output_path(__doc__)
    ring, corners = tl.scenes.torus(0.22, 0.06, 48, 16)
    turn = np.arange(160) * 2.4  # the golden angle: a galaxy of rings
    place = np.stack([np.sqrt(turn) * np.cos(turn), 4 * np.exp(-turn / 40), np.sqrt(turn) * np.sin(turn)], axis=1) / 12
    vertices = (ring + place[:, None]).reshape(-1, 3)
    mesh = tl.Mesh(vertices, (corners + len(ring) * np.arange(len(place))[:, None, None]).reshape(-1, 3))
    camera = tl.Camera.framing(mesh, elevation_deg=30, aspect=SIZE[0] / SIZE[1], fit="points")
    count = tl.overdraw(mesh.vertices, mesh.triangles, SIZE, transform=camera.clip_from_world(SIZE))
    seen = count > 0
    print(f"{count[seen].mean():.2f} triangles a pixel, at most {count.max()}")
    tl.save_image(path, ramp(np.where(seen, count, np.nan), 0))


if __name__ == "__main__":
    main()
