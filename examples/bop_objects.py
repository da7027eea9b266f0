"""BOP: a folder in its format, made here, then what its tools would tell: masks, visible shares, errors of poses.

The visible surface discrepancy (VSD) of an estimate is the share of pixels, of those that the object shows in the true
or in the estimated pose, whose distance is off by more than a tolerance or that only one of the two shows.
"""

import json
import tempfile
from pathlib import Path

import numpy as np
from picture import beside, output_path, ramp

import topleft as tl

SIZE = (320, 240)
K = [560.0, 0.0, 129.5, 0.0, 560.0, 114.5, 0.0, 0.0, 1.0]
PLACES = [(2, -60, 20, 800), (1, 10, 10, 700), (2, 90, -40, 950), (1, 230, 40, 850)]  # object, translation in mm
SHIFTS = [(4, 0, 0), (0, 0, 12), (25, 0, 0), (0, 0, 0)]  # of the estimates
TOLERANCE, NEARER = 20.0, 15.0  # mm


def write_folder(folder: Path) -> None:
    """Write one image with four objects, and two models."""
    for i, (shape, radius) in enumerate([("torus-knot", 70), ("icosahedron", 80)], 1):
        vertices, triangles = tl.scenes.shape(shape)
        vertices = vertices * (radius / np.abs(vertices).max())
        rows = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices.tolist()]
        rows += [f"f {a} {b} {c}" for a, b, c in (triangles + 1).tolist()]
        folder.joinpath(f"obj_{i:06d}.obj").write_text("\n".join(rows))
    truth = []
    for k, (i, *translation) in enumerate(PLACES):
        camera = tl.Camera.look_at((np.cos(2.0 * k), 0.5, np.sin(2.0 * k)))
        truth.append({"obj_id": i, "cam_R_m2c": camera.view[:3, :3].ravel().tolist(), "cam_t_m2c": translation})
    folder.joinpath("scene_gt.json").write_text(json.dumps({"0": truth}))
    folder.joinpath("scene_camera.json").write_text(json.dumps({"0": {"cam_K": K}}))


def distances(mesh: tl.Mesh, pose: dict, camera: tl.Camera) -> np.ndarray:
    """Distance from the camera to a mesh in a pose, mm, infinite where it is not."""
    return tl.render_layers(tl.Scene([(mesh, pose)]), camera, SIZE, layers="ray_distance")["ray_distance"]


def discrepancy(seen: np.ndarray, true: np.ndarray, estimate: np.ndarray) -> float:
    """VSD of an estimate, from distances of what the image shows and of the object in two poses."""
    visible = np.isfinite(true) & (true - NEARER <= seen)
    visible_estimate = np.isfinite(estimate) & ((estimate - NEARER <= seen) | visible)
    both = visible & visible_estimate
    off = np.count_nonzero(np.abs(true[both] - estimate[both]) > TOLERANCE)
    either = np.count_nonzero(visible | visible_estimate)
    return (off + either - np.count_nonzero(both)) / max(either, 1)


def main() -> None:
    path = output_path(__doc__)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_folder(folder)
        meshes = {i: tl.load(folder / f"obj_{i:06d}.obj") for i in (1, 2)}
        cameras, truth = (json.loads(folder.joinpath(f"scene_{part}.json").read_text()) for part in ("camera", "gt"))
    for image, objects in truth.items():
        intrinsics = np.reshape(cameras[image]["cam_K"], (3, 3))
        camera = tl.Camera.from_intrinsics(intrinsics, np.eye(4), SIZE, near=10, far=10_000)  # mm
        scene = tl.Scene([(meshes[one["obj_id"]], one) for one in objects])  # takes cam_R_m2c and cam_t_m2c
        found = tl.object_masks(scene, camera, SIZE)
        view = tl.render_layers(scene, camera, SIZE, layers=("color", "ray_distance"), color="lightgrey")
        for i, (one, shift) in enumerate(zip(objects, SHIFTS, strict=True)):
            estimate = one | {"cam_t_m2c": np.add(one["cam_t_m2c"], shift)}
            mesh = meshes[one["obj_id"]]
            error = discrepancy(view["ray_distance"], *(distances(mesh, p, camera) for p in (one, estimate)))
            info = found.scene_gt_info()[i]
            share = f"{info['visib_fract']:.0%} of {info['px_count_all']} px show"
            print(f"object {i}: {share}, box {info['bbox_obj']}, VSD {error:.3f}")
    overlap = sum(found.full(i).astype(int) for i in range(len(found)))
    hidden = found.full(0) & ~found.visible(0)
    own = np.where(found.visible(0)[..., None], [66, 135, 196], np.where(hidden[..., None], [242, 166, 90], [235] * 3))
    layers = ramp(np.where(overlap > 0, overlap, np.nan), 0, 4)
    tl.save_image(path, beside(view["color"], own.astype(np.uint8), layers))


if __name__ == "__main__":
    main()
