"""Executing tasks: an engine runs what it is given and keeps nothing that cannot be lost."""
