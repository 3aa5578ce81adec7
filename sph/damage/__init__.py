"""Damage laws, one law a file."""
