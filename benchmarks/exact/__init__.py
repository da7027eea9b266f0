"""Exact pictures to count errors against; nothing of topleft's engine."""
