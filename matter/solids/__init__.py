"""Solid bodies of any shape: closed surfaces of triangles, what they enclose, and how far from them a point lies."""
