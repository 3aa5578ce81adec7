"""Porosity laws, one law a file."""
