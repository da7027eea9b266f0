"""From a visibility buffer to light, and from light to sRGB."""
