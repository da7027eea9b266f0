"""One fixed hypothesis profile, and the count of pixels compared with the exact reference."""

import comparing
from hypothesis import HealthCheck, settings

settings.register_profile(
    "fixed", derandomize=True, deadline=None, database=None, max_examples=300, suppress_health_check=list(HealthCheck)
)
settings.load_profile("fixed")


def pytest_terminal_summary(terminalreporter):
    terminalreporter.write_line(f"{comparing.n_pixels_compared:,} pixels compared with the exact reference")
