"""A device fitted to a table of measures: every branch that fits, an ensemble in each, and what it predicts."""
