"""Lights, their points, and views of them."""
