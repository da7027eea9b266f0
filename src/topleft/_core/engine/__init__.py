"""The compiled unit, and the choice of its instruction set. It allocates scratch, calls csrc and returns its status.

blocks.pxi     keeps the memory of arrays that have died for arrays to come
buffers.pxi    describes what a pass reads and writes: viewport, vertices, buffers, indices, clipped pieces
clusters.pxi   sorts a mesh into clusters and draws those that a view needs
contract.pxi   declares the structs and kernels of csrc
detail.pxi     bounds how far points may be off in a picture: what levels of detail are chosen by
exact.pxi      draws triangles whose vertices are not snapped
isa.py         chooses the instruction set that runs, and tells how this copy was built
kernels.pyx    holds the kernel table in use; includes the parts, and gives their names to Python
lens.pxi       finds what a lens bends of a mesh, and splits it
matrices.pxi   multiplies and inverts small matrices, the same on every machine
meshlets.pxi   grows a mesh into meshlets, and draws those that a view may show
mesh.pxi       computes normals of a mesh, and distances between surfaces
pause.pxi      ends a draw: Ctrl-C, and threads whose part is given up
pixels.pxi     writes pixels that are not found by drawing triangles: means of samples, layers, points, planes, lines
polygons.pxi   draws snapped polygons: masks, labels, shares
shade.pxi      shades pixels and tests their alpha
tiles.pxi      lists the windows that triangles touch, and merges visibility buffers
triangles.pxi  draws snapped triangles: whole, by bands of rows, in layers

kernels.pyi has the types of what kernels.pyx gives.
"""

from topleft._core.engine.kernels import *  # noqa: F403
