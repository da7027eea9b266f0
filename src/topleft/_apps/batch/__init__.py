"""Many pictures: jobs, and workers that draw them."""
