"""What a case file and the stages share: bodies, materials, quantities with units."""
