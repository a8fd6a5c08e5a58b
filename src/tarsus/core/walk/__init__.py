"""Legged robots: how they are described to the engine, and what a foot can be doing."""
