"""From positions to pictures to the angle: both ways of measuring must agree on the same heap."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from analysis.repose_image import measure_repose_image
from analysis.repose_image_settings import ImageSettings
from analysis.repose_profile import ProfileSettings, measure_repose_profile
from taichidem.grains import Grains
from taichidem.render import side_views
from taichidem.walls import cup

CUP, RIM, RADIUS = 0.05, 0.03, 0.003
AZIMUTHS = range(0, 180, 30)


def poured() -> tuple[np.ndarray, np.ndarray]:
    """Return a heap that an independent DEM code poured, the grains off the cup left out."""
    centres = np.loadtxt(Path(__file__).with_name("heap_poured.csv"), delimiter=",", skiprows=3) * 1e-6
    kept = (centres[:, 2] > 0) & (np.hypot(centres[:, 0], centres[:, 1]) < 1.1 * CUP)
    return centres[kept], np.full(np.count_nonzero(kept), RADIUS)


def pictured(centres, radii, walls=()):
    """Return the angle of repose measured in side views of a heap, with the scale known from the camera."""
    views = side_views(Grains.spheres(centres, radii), AZIMUTHS, walls=walls)
    scale = ImageSettings(
        channel_order="RGB",
        base_width_m=2 * CUP,
        pixels_per_metre=views[0].pixels_per_metre,
        axis_px=views[0].origin_px[0],
        tilt_deg=0.0,
    )
    names = [f"{view.azimuth_deg:.0f}°" for view in views]
    return measure_repose_image([view.image for view in views], scale, names=names)


@pytest.mark.parametrize("angle", [22.0, 32.0])
def test_pictures_of_a_cone_of_spheres_agree_with_its_positions(heap, angle):
    centres, radii = heap(angle)
    from_pictures = pictured(centres, radii)
    from_positions = measure_repose_profile(centres, radii, CUP)
    assert from_pictures.angle_deg == pytest.approx(from_positions.angle_deg, abs=1.5)
    assert from_pictures.angle_deg == pytest.approx(angle, abs=2.0)


def test_pictures_of_a_poured_heap_agree_with_its_positions():
    centres, radii = poured()
    from_positions = measure_repose_profile(centres, radii, CUP)
    (view,) = measure_repose_image(side_views(Grains.spheres(centres, radii), [0])[0].image).views
    assert abs(view.silhouette.tilt_deg) < 0.05
    without, within = pictured(centres, radii), pictured(centres, radii, cup(CUP, RIM, "steel"))
    assert from_positions.angle_deg == pytest.approx(29.6, abs=0.1)
    assert without.angle_deg == pytest.approx(from_positions.angle_deg, abs=1.5)
    # The cup's side hides grains below the rim only: the flanks are the same.
    assert within.angle_deg == pytest.approx(without.angle_deg, abs=0.5)


def test_the_window_and_the_method_move_the_angle_of_a_poured_heap():
    centres, radii = poured()

    def angle(**settings):
        return measure_repose_profile(centres, radii, CUP, ProfileSettings(**settings)).angle_deg

    assert angle() - angle(fit_from=0.2, fit_to=0.84) > 3.0
    assert angle() - angle(method="sectors") > 5.0


def test_a_rendered_heap_saved_as_a_photograph_gives_the_same_angle(tmp_path):
    """Through a JPEG with noise, uneven light and a turned camera, the way a photograph comes."""
    (view,) = side_views(Grains.spheres(*poured()), [20.0], walls=cup(CUP, RIM, "steel"))
    straight = measure_repose_image(view.image, ImageSettings(channel_order="RGB"))
    rows, columns = view.image.shape[:2]
    turn = cv2.getRotationMatrix2D((columns / 2, rows / 2), 4.0, 0.85)
    turned = cv2.warpAffine(view.image[:, :, ::-1], turn, (columns, rows), borderValue=(255, 255, 255))
    shade = np.linspace(0.72, 1.0, columns)[None, :, None] * np.linspace(1.0, 0.85, rows)[:, None, None]
    noise = np.random.default_rng(5).normal(0, 9, turned.shape)
    path = tmp_path / "photograph.jpg"
    cv2.imwrite(str(path), np.clip(turned * shade + noise, 0, 255).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, 85])
    report = measure_repose_image(path)
    assert report.views[0].silhouette.tilt_deg == pytest.approx(4.0, abs=0.3)
    assert report.left_deg == pytest.approx(straight.left_deg, abs=0.8)
    assert report.right_deg == pytest.approx(straight.right_deg, abs=0.8)
