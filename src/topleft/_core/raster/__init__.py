"""Arrays in, arrays out: the verbs of triangles. It has never heard of a mesh of the caller's, a camera or a file.

choices.py       chooses what is done before anything is drawn: a function for each choice, for verbs and planner
classic.py       draws with a classic of the literature behind the public verbs
cluster_draw.py  draws the clusters that a view shows, and snaps what attributes need
clusters.py      sorts a mesh into clusters once, so that a view leaves out what cannot show in it
composite.py     composites the colours of sorted layers: order-independent transparency
fill.py          fills a picture with the colours of triangles, or blends them; resolves samples
fragments.py     holds a visibility buffer and interpolates attributes on it
lines.py         draws the edges of a mesh as lines
peel.py          peels depth: keeps the nearest layers of every pixel, sorted
poses.py         draws many poses of one mesh: a visibility buffer for each
rasterize.py     draws masks, counts and visibility buffers: the stages of a verb, and a function for each route
sampling.py      draws several samples a pixel, or the exact area of it
snap.py          snaps a mesh: read, transform, snap, clip
verbs.py         offers the five verbs, and `Rasterizer`, which keeps its memory from call to call
view.py          checks the options that all verbs share, once a call
"""
