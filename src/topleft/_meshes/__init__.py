"""From a mesh to a picture: models, files, scenes, cameras, levels of detail, fields, light and plans."""
