"""What ends the simulated piece of matter: images across planes (``images``: ``periodic``, ``wall``) and an outer edge
(``edge``: ``fixed``, ``quiet``)."""
