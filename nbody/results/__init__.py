"""Tables and figures of a census, beside what theory says."""
