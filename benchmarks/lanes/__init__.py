"""Kernels without Python: what each instruction set gains over scalar, here, in WebAssembly and on aarch64."""
