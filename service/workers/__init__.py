"""Executing tasks: an engine runs what it is given and holds nothing that cannot be lost."""
