"""Errors that leave a test without points and verdict, a result without its export, or nothing graded.

GradingError
├── NotSubmittedError     the submission lacks the file
├── NotGradableError      the submitted file cannot be compared with the reference
└── BrokenTestError       the test itself cannot run: its reference is missing, damaged or cannot be rendered
ExportError               the platform requires a value that is unknown
AdjustmentError           a table of points, times or students cannot be used
"""

from __future__ import annotations


class GradingError(Exception):
    """A test has no result; the message says why and what to do."""


class NotSubmittedError(GradingError):
    """The submission lacks the file that a test needs."""


class NotGradableError(GradingError):
    """The submitted file cannot be compared with the reference."""


class BrokenTestError(GradingError):
    """A test that cannot run with any submission."""


class ExportError(Exception):
    """A value that the platform requires is unknown; the message names it and says how to set it."""


class AdjustmentError(Exception):
    """A table of points, times or students cannot be used; the message follows the name of the file."""
