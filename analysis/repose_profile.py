"""Angle of repose from the positions of the grains of a heap in a cup.

Two definitions are in use, and the number depends on which: "rings" averages the upper surface of the
spheres over the azimuth, "sectors" takes the highest centre in bins of one diameter in eight sectors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from analysis.errors import AnalysisError
from analysis.flank_regression import FlankLine
from analysis.height_map import Array
from analysis.repose_profile_methods import METHODS, Grains
from analysis.repose_window import FitWindow, combine, window_uncertainty

FEWEST_GRAINS = 50
DEFAULT_WINDOWS = {"rings": FitWindow(0.4, 0.92), "sectors": FitWindow(0.15, 0.95)}


@dataclass(frozen=True)
class ProfileSettings:
    """Settings of the angle of repose from positions.

    Parameters
    ----------
    method : "rings" (upper surface of the spheres, mean over the azimuth) or "sectors" (highest centre
        in each bin of eight sectors).
    fit_from, fit_to : fit window in fractions of the cup radius [1]; None takes 0.4–0.92 for "rings"
        and 0.15–0.95 for "sectors".
    grid_spacing_m : grid of the upper surface [m]; None takes a twelfth of the diameter (0.5 mm at 6 mm).
    ring_width_m : width of the rings [m]; None takes a third of the diameter (2 mm at 6 mm).
    bin_width_m : width of the bins in the sectors [m]; None takes one diameter.
    sectors : number of sectors of the method "sectors".
    floor_m : grains whose centre lies lower have fallen off [m].

    Raises
    ------
    AnalysisError : an unknown method or a value outside its bounds.
    """

    method: str = "rings"
    fit_from: float | None = None
    fit_to: float | None = None
    grid_spacing_m: float | None = None
    ring_width_m: float | None = None
    bin_width_m: float | None = None
    sectors: int = 8
    floor_m: float = 0.0

    def __post_init__(self) -> None:
        if self.method not in DEFAULT_WINDOWS:
            raise AnalysisError(f"Method given: {self.method!r}. Allowed: 'rings' or 'sectors'.")
        for name in ("grid_spacing_m", "ring_width_m", "bin_width_m"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise AnalysisError(f"{name} given: {value}. Allowed: a positive length in metres, or None.")
        if self.sectors < 2:
            raise AnalysisError(f"sectors given: {self.sectors}. Allowed: 2 or more; 8 is usual.")
        _ = self.window

    @property
    def window(self) -> FitWindow:
        """The fit window."""
        usual = DEFAULT_WINDOWS[self.method]
        return FitWindow(
            usual.fit_from if self.fit_from is None else self.fit_from,
            usual.fit_to if self.fit_to is None else self.fit_to,
        )


@dataclass(frozen=True)
class ReposeProfileReport:
    """Angle of repose from positions.

    Attributes
    ----------
    angle_deg : angle of repose [deg].
    standard_uncertainty_deg : root of the sum of squares of `components` [deg].
    components : standard uncertainties [deg] of "azimuth" (scatter over the parts of the heap, of their
        mean) and "window" (neighbouring windows).
    method : "rings" or "sectors".
    window : the fit window, in fractions of `cup_radius_m`.
    cup_radius_m : radius of the cup [m].
    part_angles_deg : angle of each quadrant ("rings") or sector ("sectors") [deg].
    part_scatter_deg : standard deviation of these, with n − 1 [deg].
    profile : table with the columns radius_m, height_m, scatter_m (standard deviation over the parts)
        and height_1_m … of the parts; for "sectors" heights are those of centres.
    line : the straight line; its slope is that of the angle.
    grains : number of grains used.
    """

    angle_deg: float
    standard_uncertainty_deg: float
    components: dict[str, float]
    method: str
    window: FitWindow
    cup_radius_m: float
    part_angles_deg: tuple[float, ...]
    part_scatter_deg: float
    profile: pd.DataFrame
    line: FlankLine
    grains: int

    @property
    def text(self) -> str:
        """One paragraph for a reader who doesn't program."""
        low, high = self.window.limits(self.cup_radius_m)
        how = {
            "rings": "upper surface of the grains, averaged over the azimuth in rings; scatter over four quadrants",
            "sectors": f"highest centres in {len(self.part_angles_deg)} sectors",
        }[self.method]
        return (
            f"Angle of repose {self.angle_deg:.1f}° ± {self.standard_uncertainty_deg:.1f}° (standard uncertainty) from "
            f"the positions of {self.grains} grains: {how}; straight line from {low * 1e3:.0f} to {high * 1e3:.0f} mm "
            f"({self.window.fit_from:.2f}–{self.window.fit_to:.2f} of the cup radius). The parts of the heap scatter "
            f"by {self.part_scatter_deg:.1f}°. How much another heap of the same grains would differ isn't in it."
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers as plain types for JSON."""
        return {
            "angle_deg": self.angle_deg,
            "standard_uncertainty_deg": self.standard_uncertainty_deg,
            "components_deg": dict(self.components),
            "method": self.method,
            "fit_from": self.window.fit_from,
            "fit_to": self.window.fit_to,
            "cup_radius_m": self.cup_radius_m,
            "part_angles_deg": list(self.part_angles_deg),
            "part_scatter_deg": self.part_scatter_deg,
            "grains": self.grains,
            "text": self.text,
        }


def measure_repose_profile(
    centres: Array, radii: Array, cup_radius: float, settings: ProfileSettings | None = None
) -> ReposeProfileReport:
    """Measure the angle of repose of a heap on a cup whose axis is x = y = 0, θ = atan(−dz/dr).

    "rings": upper surface of the grains with r < 1.1 cup radius on a grid, mean over the azimuth in
    rings, least-squares line over the window. "sectors": in each of eight sectors the highest centre in
    bins of one diameter, least-squares line in each, mean of the slopes.

    Parameters
    ----------
    centres : grain centres [m], shape (n, 3); z is up.
    radii : grain radii [m], shape (n,), or one number for all.
    cup_radius : inner radius of the cup [m].
    settings : method and window; None takes "rings" over 0.4–0.92.

    Raises
    ------
    AnalysisError : wrong shapes, values that aren't finite, too few grains, bins or rings.

    Source: Sudsawat et al. 2023, doi 10.21303/2461-4262.2023.002968 (flank regression); the window and
    the way of averaging are this project's, as the paper states neither.
    """
    settings = settings if settings is not None else ProfileSettings()
    grains = _grains(centres, radii, cup_radius, settings)
    method = METHODS[settings.method](grains, settings)
    line, parts = method.fit(settings.window)
    angles = np.array([part.angle_deg for part in parts])
    scatter = float(angles.std(ddof=1)) if angles.size > 1 else 0.0
    components = {
        "azimuth": scatter / math.sqrt(angles.size),
        "window": window_uncertainty(line.angle_deg, _neighbours(method, settings.window)),
    }
    return ReposeProfileReport(
        angle_deg=line.angle_deg,
        standard_uncertainty_deg=combine(components),
        components=components,
        method=settings.method,
        window=settings.window,
        cup_radius_m=grains.cup_radius,
        part_angles_deg=tuple(float(angle) for angle in angles),
        part_scatter_deg=scatter,
        profile=method.table(),
        line=replace(line),
        grains=grains.radii.size,
    )


def _neighbours(method: Any, window: FitWindow) -> list[float]:
    angles = []
    for other in window.alternatives():
        try:
            angles.append(method.fit(other)[0].angle_deg)
        except AnalysisError:
            # A narrower neighbour may hold too few bins; the window asked for didn't.
            continue
    return angles


def _grains(centres: Array, radii: Array, cup_radius: float, settings: ProfileSettings) -> Grains:
    """Return the grains of the heap, checked."""
    places = np.asarray(centres, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 3:
        raise AnalysisError(f"centres given: shape {places.shape}. Allowed: (n, 3), in metres.")
    sizes = np.asarray(radii, dtype=np.float64)
    if sizes.ndim > 1 or (sizes.ndim == 1 and sizes.size != len(places)):
        raise AnalysisError(f"radii given: shape {sizes.shape}. Allowed: ({len(places)},) as centres, or one number.")
    sizes = np.broadcast_to(sizes, (len(places),))
    if not (np.isfinite(places).all() and np.isfinite(sizes).all() and (sizes > 0).all()):
        raise AnalysisError(
            "centres or radii given hold NaN, infinite or non-positive values. Allowed: finite positions and positive "
            "radii in metres. Leave out removed grains before measuring."
        )
    if not (math.isfinite(cup_radius) and cup_radius > 0):
        raise AnalysisError(f"cup_radius given: {cup_radius}. Allowed: a positive length in metres.")
    used = (np.hypot(places[:, 0], places[:, 1]) < 1.1 * cup_radius) & (places[:, 2] > settings.floor_m)
    if np.count_nonzero(used) < FEWEST_GRAINS:
        raise AnalysisError(
            f"Only {np.count_nonzero(used)} of {len(places)} grains lie above the floor and within 1.1 cup radii "
            f"({1.1 * cup_radius:.4g} m) of the axis. Allowed: {FEWEST_GRAINS} or more. Check that lengths are in "
            "metres and the cup's axis is x = y = 0, or pour more grains."
        )
    return Grains(places[used], sizes[used].copy(), float(cup_radius))
