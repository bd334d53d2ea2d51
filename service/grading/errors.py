"""Why a test gives no points and no verdict.

GradingError
├── NotSubmittedError     the submission lacks the file
├── NotGradableError      what was submitted cannot be compared; judging it would be guessing
└── BrokenTestError       the test itself cannot run: its reference is missing, damaged or not to be rendered
"""

from __future__ import annotations


class GradingError(Exception):
    """A test has no answer; the message says why and what to do."""


class NotSubmittedError(GradingError):
    """The submission lacks the file that a test is about."""


class NotGradableError(GradingError):
    """What was submitted cannot be compared with the reference."""


class BrokenTestError(GradingError):
    """A test cannot be run, whatever was submitted."""
