"""Test particles before and after: where they start, what happens to them."""
