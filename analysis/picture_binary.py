"""Turn a picture into black and white: what differs from the background is the heap and its stand.

The background is taken as a smooth surface (a polynomial of second degree in column and row, each
colour by itself) through the pixels that look like the frame's edge. Uneven light, vignetting and a
colour cast are all in that surface, so the distance of a pixel's colour to it is the same thing for a
dark heap on a light ground and a light heap on a dark one.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from analysis.errors import AnalysisError

SAMPLES_PER_SIDE = 160
ROUNDS = 5
# Ridge on the curved terms, per sample: they must not swing in the part the heap hides.
CURVATURE_PENALTY = 1e-3
FAINTEST_CONTRAST = 8.0
FEWEST_NOISE_WIDTHS = 3.0


@dataclass(frozen=True)
class BinaryImage:
    """What differs from the background, and by how much.

    Attributes
    ----------
    difference : colour distance to the background in grey levels (0–255), shape (rows, columns).
    threshold : Otsu's threshold on it, in grey levels.
    contrast : mean difference of the foreground less that of the background, in grey levels.
    noise : standard deviation of the difference in the background, in grey levels.
    noise_filter_px : size of the filter that removes specks and gaps [px].
    """

    difference: NDArray[np.float32]
    threshold: float
    contrast: float
    noise: float
    noise_filter_px: int

    def mask(self, factor: float = 1.0) -> NDArray[np.uint8]:
        """Return the binary image (1 heap, 0 background) at the threshold times `factor`, freed of specks."""
        binary = (self.difference > self.threshold * factor).astype(np.uint8)
        size = self.noise_filter_px
        kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
        # A border of background, or closing would glue the heap to the frame.
        padded = cv2.copyMakeBorder(binary, size, size, size, size, cv2.BORDER_REPLICATE)
        cleaned = cv2.morphologyEx(cv2.morphologyEx(padded, cv2.MORPH_CLOSE, kernel), cv2.MORPH_OPEN, kernel)
        return np.ascontiguousarray(cleaned[size:-size, size:-size]).astype(np.uint8)


def binarise(picture: NDArray[np.uint8], noise_filter_px: int, name: str) -> BinaryImage:
    """Separate a picture into background and what stands before it (Otsu on the normalised picture).

    Parameters
    ----------
    picture : BGR, shape (rows, columns, 3).
    noise_filter_px : width of the median filter and of the morphological filter [px], odd.
    name : the picture's name in messages.

    Raises
    ------
    AnalysisError : nothing stands out from the background.

    Source: the procedure of Sudsawat et al. 2023, doi 10.21303/2461-4262.2023.002968; threshold after
    Otsu 1979, doi 10.1109/TSMC.1979.4310076.
    """
    filtered = cv2.medianBlur(picture, noise_filter_px).astype(np.float32)
    difference = _distance(filtered, _background(filtered))
    threshold = _otsu(difference)
    above = difference > threshold
    noise, contrast = _separation(difference, above)
    if contrast < FAINTEST_CONTRAST or contrast < FEWEST_NOISE_WIDTHS * noise:
        raise AnalysisError(
            f"No heap found in {name}: nothing stands out from the background (contrast {contrast:.1f} grey levels of "
            f"255, background scatter {noise:.1f}). Allowed: a contrast of at least {FAINTEST_CONTRAST:.0f} and "
            f"{FEWEST_NOISE_WIDTHS:.0f} times the scatter. Photograph the heap before a plain, evenly lit background "
            "of another colour."
        )
    return BinaryImage(difference, threshold, contrast, noise, noise_filter_px)


def _background(picture: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the smooth surface through the background, shape (rows, columns, 3)."""
    rows, columns = picture.shape[:2]
    step = max(1, max(rows, columns) // SAMPLES_PER_SIDE)
    sample = picture[::step, ::step].reshape(-1, 3).astype(np.float64)
    across, down = np.linspace(-1, 1, columns), np.linspace(-1, 1, rows)
    basis = _basis(*np.meshgrid(across[::step], down[::step]))
    coefficients = _fit_surface(basis[:, :3], sample, _border(down[::step], across[::step]))
    coefficients = np.vstack([coefficients, np.zeros((3, 3))])
    for _ in range(ROUNDS):
        difference = np.linalg.norm(sample - basis @ coefficients, axis=1) / np.sqrt(3.0)
        ground = difference < 0.6 * _otsu(difference.astype(np.float32))
        if np.count_nonzero(ground) < 0.02 * ground.size:
            break
        coefficients = _fit_surface(basis, sample, ground)
    return _surface(coefficients, across, down)


def _surface(
    coefficients: NDArray[np.float64], across: NDArray[np.float64], down: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Return the surface at every pixel, shape (rows, columns, 3), colour by colour so that little is held at once."""
    x, y = across[None, :], down[:, None]
    surface = np.empty((down.size, across.size, 3), np.float32)
    for colour, (one, along_x, along_y, x2, xy, y2) in enumerate(coefficients.T):
        surface[:, :, colour] = (one + along_x * x + x2 * x * x) + (along_y + y2 * y + xy * x) * y
    return surface


def _border(down: NDArray[np.float64], across: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which samples lie where no heap should: the top, and the upper part of both sides."""
    top = (down < -0.76)[:, None] & np.ones(across.size, dtype=bool)[None, :]
    sides = (down < 0.3)[:, None] & (np.abs(across) > 0.88)[None, :]
    return (top | sides).ravel()


def _basis(across: NDArray[np.float64], down: NDArray[np.float64]) -> NDArray[np.float64]:
    x, y = across.ravel(), down.ravel()
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)


def _fit_surface(
    basis: NDArray[np.float64], sample: NDArray[np.float64], used: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return the coefficients of the surface, trimmed of the samples that fit it worst, shape (terms, 3)."""
    chosen = np.flatnonzero(used)
    penalty = np.zeros(basis.shape[1])
    penalty[3:] = CURVATURE_PENALTY
    coefficients = np.zeros((basis.shape[1], 3))
    for share in (1.0, 0.85, 0.85):
        matrix, values = basis[chosen], sample[chosen]
        normal = matrix.T @ matrix + np.diag(penalty * chosen.size + 1e-9)
        coefficients = np.linalg.solve(normal, matrix.T @ values)
        miss = np.linalg.norm(values - matrix @ coefficients, axis=1)
        # Keeps ties, so that a perfectly even ground isn't thinned out.
        chosen = chosen[miss <= np.quantile(miss, share) + 1e-9]
    return coefficients


def _distance(picture: NDArray[np.float32], background: NDArray[np.float32]) -> NDArray[np.float32]:
    difference = np.sqrt(np.mean((picture - background) ** 2, axis=2))
    return np.minimum(difference, 255.0).astype(np.float32)


def _otsu(difference: NDArray[np.float32]) -> float:
    """Return Otsu's threshold of values in 0–255, to 1/4 grey level so that faint pictures aren't quantised."""
    counts, edges = np.histogram(difference, bins=1020, range=(0.0, 255.0))
    centres = (edges[:-1] + edges[1:]) / 2.0
    below = np.cumsum(counts)
    above = below[-1] - below
    total = np.cumsum(counts * centres)
    with np.errstate(divide="ignore", invalid="ignore"):
        between = below * above * (total / below - (total[-1] - total) / above) ** 2
    between = np.where(np.isfinite(between), between, 0.0)
    # Between two separate classes the criterion is flat: its middle is the threshold.
    best = np.flatnonzero(between >= between.max() * (1 - 1e-12))
    return float(edges[1:][best].mean())


def _separation(difference: NDArray[np.float32], above: NDArray[np.bool_]) -> tuple[float, float]:
    """Return the scatter of the background and the contrast of the foreground, in grey levels."""
    if not above.any() or above.all():
        return float(difference.std()), 0.0
    ground = difference[~above]
    return float(ground.std()), float(difference[above].mean() - ground.mean())
