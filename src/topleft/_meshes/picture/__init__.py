"""From a mesh or a scene and a camera to pictures and layers."""
