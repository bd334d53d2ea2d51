"""Visibility of light points, decided without an epsilon."""
