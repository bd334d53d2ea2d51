"""A class: all its submissions graded in one process, compared with each other, resumable."""
