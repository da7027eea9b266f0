"""Levels of detail: time beside error."""
