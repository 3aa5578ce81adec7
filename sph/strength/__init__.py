"""Yield laws, one law a file."""
