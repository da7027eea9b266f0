"""Limits of a file, counted over all of it: beyond them it is not unpacked."""
