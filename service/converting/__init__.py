"""Scenes out of other programs' files, with a list of all that had to be assumed or left out."""
