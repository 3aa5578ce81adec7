"""Published claims, scored against runs."""
