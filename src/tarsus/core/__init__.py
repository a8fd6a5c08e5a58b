"""The core: the native engine and its inputs: nodes, contact modes, blocks, on plain arrays (numpy only)."""
