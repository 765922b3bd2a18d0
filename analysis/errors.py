"""The error every analyser raises when its input can't give an answer."""

from __future__ import annotations


class AnalysisError(ValueError):
    """Input an analyser can't use; the message says what was given, what is allowed and what to do."""
