"""Studies: loops around simulations that score them against something."""
