"""Files that nobody here made, drawn as `topleft render` draws them; docs/measured/real_files.md.

study.py   arguments; draws all files of folders, in a process that may fail
drawing.py draws one file, and says what came of it
sheets.py  contact sheets
tables.py  the page of a run, and the tables of the documentation
"""
