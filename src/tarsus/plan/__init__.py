"""Scene to arrays: what the engine is given, and which of its numbers are data."""
