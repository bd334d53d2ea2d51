"""Scenes and their parts as a user writes them."""
