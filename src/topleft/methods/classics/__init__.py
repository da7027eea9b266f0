"""The methods of the literature as published, as compiled kernels; `topleft.methods.twins` has them in Python.

A kernel draws triangles over a picture. The kernels are compiled as a module, which has a stub.
"""
