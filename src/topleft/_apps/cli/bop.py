"""`topleft bop`: boxes, visible shares and masks of BOP's objects, from poses and models."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from topleft import Camera, Mesh, ObjectMasks, Scene, load, object_masks, save_image
from topleft._apps.cli.arguments import UsageError, add_command, add_scale, number, positive, size, within
from topleft._apps.cli.report import write_json
from topleft._core.base.array_types import Array
from topleft.annex.pictures import as_pose
from topleft.errors import MeshError

BOP_HELP = """\
SCENE is a folder of BOP's format with scene_camera.json and scene_gt.json, as test/000001 is; models are
DIR/obj_000001.ply and so on. OUT gets the content of scene_gt_info.json: pixels, visible shares and boxes of each
object of each image. Objects of scene_gt.json hide each other: the tools of BOP ask the measured depth
instead. Where there is a depth/000001.png, px_count_valid counts its pixels that are not 0.

examples:
  topleft bop lmo/test/000002 --models lmo/models -o info.json --size 640x480
  topleft bop lmo/test/000002 --models lmo/models -o info.json --coco coco.json --masks masks
"""

PICTURES = number(within(0, 1000), "a number from 0 to 1000")
FOLDERS = ("rgb", "gray", "depth")
SUFFIXES = (".png", ".jpg", ".tif")


def run_bop(options: argparse.Namespace) -> int:
    """Write boxes, visible shares and masks of the objects of a scene in BOP's format."""
    folder = Path(options.scene)
    cameras, truth = (read_json(folder / name) for name in ("scene_camera.json", "scene_gt.json"))
    meshes: dict[int, Mesh] = {}
    info: dict[str, Any] = {}
    content: dict[str, list[Any]] = {"images": [], "annotations": [], "categories": []}
    for image, objects in truth.items():
        if image not in cameras:
            raise MeshError(f"{str(folder / 'scene_camera.json')!r} has no image {image}, which scene_gt.json has")
        width, height = options.size or size_of(folder, image)
        try:
            ids = [int(one["obj_id"]) for one in objects]
            poses = [as_pose("the pose of an object", one) for one in objects]
            intrinsics = np.array(cameras[image]["cam_K"], np.float64).reshape(3, 3)
        except (KeyError, TypeError, ValueError) as error:
            raise MeshError(f"image {image} of {str(folder)!r} is not as BOP has it: {error}") from None
        for own in ids:
            if own not in meshes:
                meshes[own] = read_model(Path(options.models) / f"obj_{own:06d}.ply", options.scale)
        if objects:
            found = masks_of([meshes[own] for own in ids], poses, intrinsics, (width, height), options)
            info[image] = found.scene_gt_info(depth_of(folder, image, (width, height)))
        else:
            info[image] = []
        if objects and options.masks:
            save_masks(Path(options.masks), int(image), found)
        content["images"].append({"id": int(image), "file_name": f"{int(image):06d}", "width": width, "height": height})
        if objects:
            first = len(content["annotations"]) + 1
            content["annotations"] += found.annotations(int(image), ids, first_id=first)
    content["categories"] = [{"id": own, "name": f"obj_{own:06d}"} for own in sorted(meshes)]
    write_json(Path(options.out), info)
    if options.coco:
        write_json(Path(options.coco), content)
    return 0


def masks_of(
    meshes: list[Mesh], poses: list[Any], intrinsics: Array, frame: tuple[int, int], options: argparse.Namespace
) -> ObjectMasks:
    """Return the masks of an image."""
    for pose in poses:
        pose[:3, 3] *= options.scale
    scene, camera = Scene(list(zip(meshes, poses, strict=True))), Camera.from_intrinsics(intrinsics, np.eye(4), frame)
    return object_masks(scene, camera, frame, beyond=options.beyond, threads=options.threads)


def read_json(path: Path) -> Mapping[str, Any]:
    """The object in a JSON file."""
    try:
        content = json.loads(path.read_bytes())
    except (ValueError, RecursionError) as error:
        raise MeshError(f"cannot read {str(path)!r}: {error}") from None
    if not isinstance(content, dict) or not all(key.isdecimal() for key in content):
        raise MeshError(f"cannot read {str(path)!r}: it must hold an object with the numbers of images")
    return content


def read_model(path: Path, scale: float) -> Mesh:
    """The mesh of an object."""
    mesh = load(path, scale=scale)
    if not isinstance(mesh, Mesh):
        raise MeshError(f"{str(path)!r} has points and no triangles")
    return mesh


def size_of(folder: Path, image: str) -> tuple[int, int]:
    """Width and height of the picture of an image."""
    path = picture_of(folder, image, FOLDERS)
    if path is None:
        raise UsageError(f"--size is needed: {str(folder)!r} has no picture of image {image} in {', '.join(FOLDERS)}")
    from PIL import Image

    with Image.open(path) as picture:
        width, height = picture.size
    return width, height


def depth_of(folder: Path, image: str, frame: tuple[int, int]) -> Array | None:
    """The measured depth of an image, if there is one."""
    path = picture_of(folder, image, ("depth",))
    if path is None:
        return None
    from PIL import Image

    with Image.open(path) as picture:
        if picture.size != frame:
            raise MeshError(f"{str(path)!r} has {picture.size[0]}x{picture.size[1]} pixels, not {frame[0]}x{frame[1]}")
        return np.asarray(picture)


def picture_of(folder: Path, image: str, folders: tuple[str, ...]) -> Path | None:
    """The first file of an image in several folders."""
    paths = (folder / name / f"{int(image):06d}{suffix}" for name in folders for suffix in SUFFIXES)
    return next((path for path in paths if path.is_file()), None)


def save_masks(folder: Path, image: int, found: ObjectMasks) -> None:
    """Write the masks of an image as BOP names them: mask/000001_000000.png and mask_visib/000001_000000.png."""
    for name, mask_of in (("mask", found.full), ("mask_visib", found.visible)):
        folder.joinpath(name).mkdir(parents=True, exist_ok=True)
        for i in range(len(found)):
            save_image(folder / name / f"{image:06d}_{i:06d}.png", mask_of(i))


def add_bop_command(commands: Any) -> None:
    """Add the command to the parsers of the command line."""
    bop = add_command(
        commands, "bop", run_bop, "write boxes, visible shares and masks of objects in BOP's format", BOP_HELP
    )
    add = bop.add_argument
    add("scene", metavar="SCENE", help="a folder with scene_camera.json and scene_gt.json")
    add("--models", required=True, metavar="DIR", help="the folder of obj_000001.ply and so on")
    add("-o", "--out", required=True, metavar="OUT", help="where scene_gt_info.json goes")
    add("--coco", metavar="FILE", help="annotations of COCO with run lengths, besides")
    add("--masks", metavar="DIR", help="a folder for mask/ and mask_visib/, besides")
    add("--size", type=size, metavar="WxH", help="of the images (that of their pictures)")
    add("--beyond", type=PICTURES, default=1.0, metavar="N", help="how many pictures beyond the frame count (1)")
    add_scale(bop)
    add("--threads", type=positive, metavar="N", help="how many at most")
