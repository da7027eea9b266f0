"""From a mesh or a scene and a camera to pictures and layers.

bend.py             bent edges: a mesh as a lens sees it, in triangles whose sides are straight in the picture to with
layers.py           the registry of layers: what a view of a mesh or scene shows, by name
notebook.py         what a result shows of itself in a notebook: a mesh its picture, a visibility buffer its triangles
render.py           rendering: a mesh or scene and a camera to a picture, in one call
scene_clusters.py   scenes of clustered meshes: instances are drawn from front to back, without what those before hide
scene_cutout.py     cut-outs of scenes: what lies behind a hole may belong to another instance
scene_draw.py       scenes into buffers: each instance is snapped and drawn over what the ones before have left
scene_fragments.py  the visibility buffer of a scene: which instance, and which of its triangles, shows in each pixel
scene_lens.py       scenes through a lens: each instance is bent by itself, then they are drawn as a scene that no len
scene_render.py     pictures of scenes: each instance is shaded by itself, in the rectangle that it shows in
sight.py            what a camera sees of a mesh or scene, and where in space each visible pixel lies: computed when i
silhouette.py       silhouettes: where a mesh or scene is, seen by a camera, as a mask
transparent.py      transparent pictures: every layer of a mesh or scene is shaded, then they are seen through each ot
view_layers.py      layers for vision: depth, normals, positions, ids, flow and what else a view shows, as named array
"""
