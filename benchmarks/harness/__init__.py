"""The tools of measurement: processes, turns, records."""
