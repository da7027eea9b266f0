"""Arrays, options, memory, threads, colours, grids: no triangle, no picture."""
