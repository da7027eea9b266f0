"""The plan of a draw: its choices, their costs, their reasons."""
