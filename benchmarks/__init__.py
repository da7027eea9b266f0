"""What topleft is measured with: scenes, contestants that take turns, the exact result beside the time."""
