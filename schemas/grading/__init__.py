"""Assignments and their grades: manifests, what they accept, and the result of grading."""
