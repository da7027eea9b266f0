"""Tensors of pixels, and their vector-Jacobian products with vertices, attributes and texels."""
