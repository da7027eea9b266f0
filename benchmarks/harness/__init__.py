"""What measures: processes, turns, records."""
