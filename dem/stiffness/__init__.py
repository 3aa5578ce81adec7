"""Contact stiffness that follows the motion and stiffens towards rest."""
