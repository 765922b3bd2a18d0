"""What the user states about a heap picture: where to look, how large things are, which part of the flank counts."""

from __future__ import annotations

import math
from dataclasses import dataclass

from analysis.errors import AnalysisError
from analysis.picture_input import Region
from analysis.repose_window import FitWindow


@dataclass(frozen=True)
class ImageSettings:
    """Settings of the angle of repose from pictures.

    Parameters
    ----------
    region : region of interest (left, top, right, bottom) [px], last column and row not included; None: all.
    fit_from, fit_to : fit window in fractions of the base half-width [1].
    base_width_m : known width of the base (the cup's inner diameter) [m]; needs `pixels_per_metre`, or
        else gives the scale from the base as seen.
    pixels_per_metre : scale of the picture [px/m].
    base_width_px : known width of the base in the picture [px]; instead of the two above.
    axis_px : column of the heap's axis at the base [px]; None takes the middle of the base as seen.
    tilt_deg : camera tilt, positive where the horizontal rises to the right [deg]; None finds it.
    channel_order : "BGR" or "RGB" of pictures given as arrays.
    noise_filter_px : width of the noise filter [px], odd, 3 or more.

    Raises
    ------
    AnalysisError : a value outside its bounds.
    """

    region: Region | None = None
    fit_from: float = 0.4
    fit_to: float = 0.92
    base_width_m: float | None = None
    pixels_per_metre: float | None = None
    base_width_px: float | None = None
    axis_px: float | None = None
    tilt_deg: float | None = None
    channel_order: str = "BGR"
    noise_filter_px: int = 5

    def __post_init__(self) -> None:
        FitWindow(self.fit_from, self.fit_to)
        for name in ("base_width_m", "pixels_per_metre", "base_width_px"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise AnalysisError(f"{name} given: {value}. Allowed: a positive number, or None where it isn't known.")
        if self.tilt_deg is not None and not abs(self.tilt_deg) <= 15.0:
            raise AnalysisError(
                f"tilt_deg given: {self.tilt_deg}. Allowed: −15 to 15 degrees, or None to find it in the picture."
            )
        if self.noise_filter_px < 3 or self.noise_filter_px % 2 == 0:
            raise AnalysisError(f"noise_filter_px given: {self.noise_filter_px}. Allowed: 3, 5, 7, …; 5 suits most.")

    @property
    def window(self) -> FitWindow:
        """The fit window."""
        return FitWindow(self.fit_from, self.fit_to)

    def half_width(self, seen_half_width: float, name: str) -> float:
        """Return the half-width of the base that the window is a fraction of [px].

        Parameters
        ----------
        seen_half_width : half-width of what stands out in the picture [px].
        name : the picture's name in messages.

        Raises
        ------
        AnalysisError : the width given can't be the width of what is seen.
        """
        given = self.base_width_px
        if given is None and self.base_width_m is not None and self.pixels_per_metre is not None:
            given = self.base_width_m * self.pixels_per_metre
        if given is None:
            return seen_half_width
        if not 0.6 <= given / (2.0 * seen_half_width) <= 1.5:
            raise AnalysisError(
                f"The base of {name} is given as {given:.0f} pixels wide, but what stands out is "
                f"{2.0 * seen_half_width:.0f} pixels wide. Allowed: 0.6 to 1.5 times that. "
                "Check base_width_m, pixels_per_metre and base_width_px."
            )
        return given / 2.0

    def scale(self, half_width: float) -> float | None:
        """Return the pixels per metre, given or from the known width of the base; None where neither is known."""
        if self.pixels_per_metre is not None:
            return self.pixels_per_metre
        return None if self.base_width_m is None else 2.0 * half_width / self.base_width_m
