"""Applications: batches, rasters without end, the explorer, diagrams and the command line, on public names."""
