"""The study of the cases: every contestant, in turns.

study.py          arguments, and who takes part
tables.py         each scene, and a summary
scene_tables.py   meshes, strewn triangles and fills, for docs/measured/performance.md
smooth_tables.py  the anti-aliased cases, for docs/measured/performance.md
"""
