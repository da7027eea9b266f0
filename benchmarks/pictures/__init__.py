"""Pictures beside those of OpenGL; docs/measured/pictures.md.

study.py   arguments; compares colours and ids
scenes.py  the scenes
opengl.py  draws them by moderngl on llvmpipe
tables.py  the page's tables
"""
