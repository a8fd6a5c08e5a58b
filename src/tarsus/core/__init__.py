"""The hot house: exact flow, event location and contact modes on plain arrays (numpy and numba only)."""
