"""What an impact did to a body of any shape: its surface before and after, its axes, rotation, momentum and orbit."""
