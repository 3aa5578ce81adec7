"""Craters beside each other and beside what was observed or published."""
