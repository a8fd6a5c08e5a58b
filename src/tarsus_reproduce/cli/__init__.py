"""The verb `reproduce` of the command line."""
