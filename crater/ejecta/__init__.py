"""Launch, flight and fall of the ejecta, and the blanket that they leave."""
