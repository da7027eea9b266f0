"""Values that pictures are drawn from: meshes, points, materials, textures and lights."""
