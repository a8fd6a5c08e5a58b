"""Tarsus: contact dynamics of legged piezoelectric micro-robots."""
