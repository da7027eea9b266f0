"""From a mesh or a scene and a camera to pictures and layers.

bend.py          bends edges: splits triangles until their sides are straight in the picture of a lens
blended.py       draws materials that what is behind shows through, over what is opaque
edges.py         draws the edges of triangles over a picture, those that show
fragments.py     holds what each instance shows: visibility buffers of scenes and through a lens, and their parts
gbuffer.py       evaluates where in space each visible pixel lies, when a layer asks for it
holes.py         takes out what materials cut out, so that what lies behind a hole shows, of any instance
instances.py     draws the instances of a scene into one buffer, whole or in clusters, from front to back
layers.py        draws each layer by its name: the registry of all there are
notebook.py      makes the picture that a mesh or a visibility buffer shows of itself in a notebook
render.py        renders: a mesh or scene and a camera to a picture, or to its visibility buffer, in one call
scene_shade.py   shades a visibility buffer, of a scene each instance by itself, where it shows
silhouette.py    draws silhouettes: where a mesh or scene is, as a mask
through_lens.py  finds what to draw of a mesh or scene: itself, or the parts that its lens makes of it
transparent.py   draws transparent pictures: peels layers, shades each and composites them
view_layers.py   draws layers for vision, as named arrays in one call: depth, normals, ids, flow and more
"""
