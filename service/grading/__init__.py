"""Grading: a submission held to the tests of a manifest, and what came out in the forms of several platforms."""
