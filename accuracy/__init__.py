"""Accuracy of pictures and its cost: comparison, convergence, quotes, studies, a self-test."""
