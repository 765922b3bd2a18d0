"""The interface of an analyser, and the settings shared by those that fit a polynomial."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import pandas as pd

from analysis.errors import AnalysisError
from analysis.report import Report
from designs.errors import nearest_hint
from designs.space import FactorSpace

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, kw_only=True)
class Analyser(abc.ABC):
    """Something that turns a table of runs into a report.

    Subclasses are frozen, keyword-only dataclasses: their fields are the settings, ``analyse`` does the work, the first
    sentence of their docstring is the summary that lists show.
    """

    name: ClassVar[str] = ""
    #: How many responses it takes: (least, most); most = None means any number.
    n_responses: ClassVar[tuple[int, int | None]] = (1, 1)

    @abc.abstractmethod
    def analyse(
        self,
        table: pd.DataFrame,
        *,
        responses: Sequence[str] = (),
        factors: Sequence[str] | None = None,
        space: FactorSpace | None = None,
    ) -> Report:
        """Return the report on a table of runs.

        Args:
            table: one row per run, natural units.
            responses: names of the response columns.
            factors: names of the factor columns; default all but the responses and the run table's own columns.
            space: factors with low and high for the coding; default the range of each column.

        Raises:
            AnalysisError: for a table or settings that can't be analysed.
        """

    def figures(self, report: Report) -> dict[str, Figure]:
        """Return the pictures of a report by name; none unless the analyser has some."""
        return {}

    @classmethod
    def settings(cls) -> dict[str, Any]:
        """Return the settings by name with their defaults."""
        return {f.name: None if f.default is dataclasses.MISSING else f.default for f in dataclasses.fields(cls)}

    @classmethod
    def summary(cls) -> str:
        """Return the first line of the docstring."""
        return next(iter((cls.__doc__ or "").strip().splitlines()), "")

    def check_responses(self, responses: Sequence[str]) -> tuple[str, ...]:
        """Return the responses if their number is right.

        Raises:
            AnalysisError: for too few or too many, or one named twice.
        """
        if isinstance(responses, str):
            responses = (responses,)
        least, most = self.n_responses
        if len(responses) < least or (most is not None and len(responses) > most):
            wanted = f"exactly {least}" if least == most else f"at least {least}"
            raise AnalysisError(f"{self.name} needs {wanted} response(s); {list(responses) or 'none'} given.")
        if len(set(responses)) < len(responses):
            raise AnalysisError(f"{self.name} was given a response twice: {list(responses)}. Name each once.")
        return tuple(responses)


def check_choice(owner: Analyser, setting: str, value: Any, allowed: Iterable[str]) -> None:
    """Raise an ``AnalysisError`` unless the value is one of the allowed words, naming the nearest."""
    names = list(allowed)
    if value not in names:
        raise AnalysisError(f"{owner.name} has {setting} = {value!r}. {nearest_hint(str(value), names)}")


def check_fraction(owner: Analyser, setting: str, value: Any) -> None:
    """Raise an ``AnalysisError`` unless the value is a number between 0 and 1."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 < value < 1:
        raise AnalysisError(f"{owner.name} has {setting} = {value!r}; a number between 0 and 1 is needed.")
