"""The command ``penumbra``: one file for each command or small group, all listed in ``commands.py``."""
