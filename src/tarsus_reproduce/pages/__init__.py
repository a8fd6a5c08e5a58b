"""Pages of the reproduction: one self-contained HTML file an experiment."""
