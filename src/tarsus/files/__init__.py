"""Files: scenes in TOML, the library of devices, and the run store."""
