"""The core: the native engine, and what it is told by: nodes, contact modes, blocks, on plain arrays (numpy only)."""
