"""A run: its plan, its processes, its journal and its results."""
