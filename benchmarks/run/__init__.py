"""The study of the cases: every contestant, in turns.

study.py          arguments, and who takes part
tables.py         each scene, and a summary
smooth_tables.py  the anti-aliased cases, for docs/measured/performance.md
"""
