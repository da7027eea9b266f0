"""What topleft is measured with: scenes, contestants that take turns, the exact result beside the time.

A room imports from those above it alone, and no study from another.

scenes/    what is drawn
peers/     who draws it: topleft and others, one file each
harness/   what measures: processes, turns, records
report/    tables, charts and pages, and the protocol of a study
run/ accuracy/ atlas/ choices/ static/ pictures/ levels/ small/   the studies
records/   what was measured, as the pages show it
"""
