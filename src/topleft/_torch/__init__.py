"""What `topleft.torch` stands on: operators of PyTorch, and checks of its tensors."""
