"""Settings of the stages from a case: composed, checked, described."""
