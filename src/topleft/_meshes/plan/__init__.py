"""What a draw needs, what it will cost, and why.

calibrate.py  measures this machine and fits the costs to it
costs.py      estimates times from measured costs, which costs.json holds
facts.py      finds what decides how triangles are drawn, by the code that draws them
plan.py       defines `Plan` and makes one, for arrays or for a mesh and a camera
stages.py     tells of each stage what was chosen, why, and what it should take
table.py      prints a plan as text and as HTML
"""
