"""Compilation of kernels and laws, and the cache of compiled code."""
