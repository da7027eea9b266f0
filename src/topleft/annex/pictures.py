"""Prepares and draws pictures step by step: cameras, poses, levels, samples, layers, instruction sets."""

from topleft._core.engine import isa_available, isa_in_use, use_isa
from topleft._core.raster.sampling import sample_positions
from topleft._meshes.camera.camera import CameraLike, as_camera
from topleft._meshes.camera.matrices import (
    bounding_sphere,
    box_corners,
    ends_to_frame,
    frame_of_sphere,
    orbit_view,
    tangent,
)
from topleft._meshes.lod.levels import keep_levels
from topleft._meshes.lod.simplify import levels_of
from topleft._meshes.model.pose import as_pose
from topleft._meshes.picture.view_layers import layers_of

__all__ = [
    "CameraLike",
    "as_camera",
    "as_pose",
    "bounding_sphere",
    "box_corners",
    "ends_to_frame",
    "frame_of_sphere",
    "isa_available",
    "isa_in_use",
    "keep_levels",
    "layers_of",
    "levels_of",
    "orbit_view",
    "sample_positions",
    "tangent",
    "use_isa",
]
