"""The surface of a cloud as heights over a datum, and where the crater lies in it."""
