"""The measurements of topleft: scenes, contestants that take turns, the exact result beside the time.

A room imports from those above it alone, and no study from another.

scenes/    the scenes
peers/     who draws it: topleft and others, one file each
harness/   the tools of measurement: processes, turns, records
report/    tables, charts and pages, and the protocol of a study
run/ accuracy/ atlas/ choices/ static/ pictures/ levels/ small/   the studies
records/   the measurements, as the pages show them
"""
