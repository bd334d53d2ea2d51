"""Lifecycle of renders, jobs and steps: rows, clocks and fairness."""
