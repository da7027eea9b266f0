"""The operators of PyTorch that `topleft.torch` calls, with the checks of its tensors."""
