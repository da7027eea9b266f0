"""Points, drawn as discs or squares: arrays in pixels or clip space, and clouds seen by a camera."""
