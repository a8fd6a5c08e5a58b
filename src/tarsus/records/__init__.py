"""What instruments recorded: measurements and the readers of their files."""
