"""Values and heights of meshes on a grid."""
