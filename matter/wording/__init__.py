"""Names, numbers and measures as people read them."""
