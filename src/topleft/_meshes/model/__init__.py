"""What is drawn: meshes, points, materials, textures and lights."""
