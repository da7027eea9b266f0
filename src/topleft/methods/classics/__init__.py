"""The methods of the literature as published, as compiled kernels; `topleft.methods.twins` is the same in Python.

A kernel draws triangles over a picture. They are compiled as one module, which has a stub.
"""
