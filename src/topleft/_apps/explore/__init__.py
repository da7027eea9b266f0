"""The explorer: a page in the browser in which triangles are moved and their pixels watched.

content.py    makes what is shown of what is given: arrays, a mesh, a file, a scene, a link
exact.py      draws small scenes exactly, in Python's integers
export.py     writes what is shown: PNG, SVG, code, a test case
handlers.py   lists what a page may ask, and answers it
mesh_view.py  draws the view of a mesh that a page asks for
messages.py   packs questions and answers: a JSON header and arrays behind it
notebook.py   shows the page in the cell of a notebook
open.py       opens the explorer: `topleft.explore`
pixels.py     draws the part Pixels: pictures of methods, and where they differ
probe.py      says why a pixel is whose
race.py       draws the atlas live: where methods are wrong along a family of scenes
server.py     serves the page and its socket on the loopback
session.py    holds what is shown, and what one page has of it
state.py      checks the state of the part Pixels
trace.py      records how a method draws, step by step

`page` holds the page itself: HTML, CSS and one JavaScript module.
"""
