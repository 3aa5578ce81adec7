"""A census of encounters, and how sound its integration is."""
