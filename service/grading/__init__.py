"""Grading: a submission is held to the tests of a manifest; each platform gets the result in its own form."""
