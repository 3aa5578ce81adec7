"""The store of finished stages, shared by runs."""
