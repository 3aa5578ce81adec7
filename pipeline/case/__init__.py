"""The case file: read, filled in, overlaid and explained."""
