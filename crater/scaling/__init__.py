"""Crater sizes and melt volumes by scaling laws."""
