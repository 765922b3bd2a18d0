"""Bulk tests, one per file."""

from taichidem.experiments.base import Experiment, Observable, Outcome, Settings
from taichidem.experiments.fixed_funnel import FixedFunnel

BUILT_IN = {experiment.name: experiment for experiment in (FixedFunnel,)}

__all__ = ["BUILT_IN", "Experiment", "FixedFunnel", "Observable", "Outcome", "Settings"]
