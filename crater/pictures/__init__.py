"""The pictures of a run, one subject a file."""
