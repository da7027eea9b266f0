"""Kernels without Python: the gain of each instruction set over scalar, here, in WebAssembly and on aarch64."""
