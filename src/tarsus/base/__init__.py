"""What every floor stands on: descriptions and their paths, units, messages, errors, registries, kinds of events."""
