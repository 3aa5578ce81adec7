"""Bulk flows of grains with known answers: column, heap, hopper, carved bowl."""
