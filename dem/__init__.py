"""Stages 3 and 5: soft-sphere grains, the settled bed and the late collapse."""
