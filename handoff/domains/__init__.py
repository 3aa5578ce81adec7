"""The volume that a bed fills."""
