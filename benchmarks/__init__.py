"""Benchmarks: scripts of their own, and the suites of ``peers`` (also for ``asv``, which wants a package)."""
