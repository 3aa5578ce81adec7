"""Contact laws, one law a file."""
