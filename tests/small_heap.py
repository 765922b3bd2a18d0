"""A heap so small that it is poured in seconds; its slope means little, but everything after it is the same."""

from __future__ import annotations

SMALL = {
    "diameter": 0.003,
    "cup_radius": 0.024,
    "rim_height": 0.004,
    "stream_radius": 0.009,
    "stream_bottom": 0.024,
    "stream_top": 0.06,
    "stream_rate": 2000.0,
    "batch_interval": 0.02,
    "drop_velocity": 0.4,
    "particles": 1000,
    "settle_time": 0.15,
    "longest_settle_time": 0.25,
    "method": "rings",
    "fit_from": 0.4,
    "fit_to": 0.92,
}

# The same as a user would type it, some with units.
SMALL_TYPED = [
    "diameter=3 mm",
    "cup_radius=24mm",
    "rim_height=0.4 cm",
    "stream_radius=0.009",
    "stream_bottom=24 mm",
    "stream_top=60 mm",
    "stream_rate=2000 1/s",
    "batch_interval=20 ms",
    "drop_velocity=0.4 m/s",
    "particles=1000",
    "settle_time=150 ms",
    "longest_settle_time=0.25",
    "method=rings",
    "fit_from=0.4",
    "fit_to=0.92",
]
