"""What reproduces one paper or measures this project itself; not in the wheel."""
