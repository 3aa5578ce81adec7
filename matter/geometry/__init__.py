"""Frames, trees, neighbours, tetrahedra and alpha-shapes."""
