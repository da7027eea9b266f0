"""What a draw needs, what it will cost, and why."""
