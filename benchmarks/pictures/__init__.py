"""Pictures beside those of OpenGL; docs/measured/pictures.md."""
