"""What every room stands on: checked arrays, options, memory, threads, colours. It knows no triangle.

arrays.py   coercion and checks: what the caller gives becomes contiguous native arrays, or an error that names the ar
color.py    colours: sRGB values of 0 to 255, the light that they stand for, and a colour for each id
memory.py   memory of a call: fresh arrays, arrays that are kept from call to call, and scratch that a thread keeps
options.py  values that options take: every option is a string in the API and an enum inside
threads.py  threads: rows of one picture, drawn side by side. The pool costs nothing until it is used and survives ``f
"""
