"""Arrays in, arrays out: the verbs of triangles. It has never heard of a mesh, a camera or a file.

area.py       exact areas: the cells between edges and pixels, and what is done when 32 bits do not hold a sum
blend.py      blending: colours of triangles into a picture, one triangle after the other, in bands of rows
choices.py    what is chosen before anything is drawn: a small function for each choice, asked by the pipeline and by
classic.py    the classics behind the public verbs: checks, one kernel call, the same buffers
clustered.py  drawing clusters: a view takes what it needs of a mesh from vertices to pixels, cluster by cluster
clusters.py   clusters: a mesh sorted once, so that a view leaves out what cannot show in it
composite.py  order-independent transparency: colours of sorted layers, seen through each other
fill.py       colours of triangles into a picture: which triangle shows in each pixel, or each triangle blended in its
fragments.py  the visibility buffer: which triangle shows in each pixel, how deep, and attributes on top of it
lines.py      the edges of a mesh as lines: which edges, then their pixels
peel.py       depth peeling: the nearest layers of every pixel, sorted
rasterize.py  the pipeline as named stages, and what each verb does with it
resolve.py    one colour a pixel from those of its samples: the mean of the values, or of the light that they stand fo
sampling.py   several samples a pixel: where they lie, and the grid that holds them
snap.py       from the caller's arrays to snapped vertices and checked indices: transform, clip and snap
verbs.py      the five verbs on fresh memory, and `Rasterizer`, the same on memory that is kept
view.py       the options that all verbs share, checked once per call
"""
