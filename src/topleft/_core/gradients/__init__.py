"""Tensors of pixels, and what vertices, attributes and texels would do to them: vector-Jacobian products."""
