"""Promises of the service under load, each with a figure: ``make load``."""
