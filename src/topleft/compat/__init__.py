"""Other libraries' names for what topleft draws: change one import, and a program needs neither GPU nor display.

The modules of this package have the calls of the libraries that they are called after. They are written from
documentation and behaviour, use public names of `topleft` alone, and import those libraries only where they are handed
objects of theirs.
"""
