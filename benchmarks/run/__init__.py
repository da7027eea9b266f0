"""The study of the cases: every contestant, in turns."""
