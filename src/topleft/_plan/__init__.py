"""What a draw needs, what it will cost, and why.

calibrate.py      what this machine needs per vertex, triangle and pixel: scenes are measured, and costs fitted to the
costs.py          what things cost on a machine, fitted to measurements, and estimates of scenes from it
plan_clusters.py  what clusters do for a view of a mesh, counted before the plan is told: how many are left out, and b
plan_facts.py     what a scene is, found by the code that draws it: transform, clip and snap, then a census instead of
plan_memory.py    the bytes that a call needs, told before it runs: each name that the pipeline asks `Memory` for
plan_stages.py    what happens to a scene, stage by stage: what was chosen, why, what was left out, and what it should
plan_table.py     A plan as text and as HTML. In: what `Plan.to_dict` gives. Out: a string
planner.py        `plan`: what a scene needs, what was left out, and why, before it is drawn
"""
