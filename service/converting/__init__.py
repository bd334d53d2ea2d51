"""Conversion of other programs' files to scenes, with a list of what was assumed or left out."""
