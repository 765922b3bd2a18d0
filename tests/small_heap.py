"""A heap so small that it is poured in a second; its slope means little, but everything after it is the same."""

from __future__ import annotations

SMALL = {
    "particles": 150,
    "cup_radius": 0.02,
    "rim_height": 0.006,
    "stream_radius": 0.012,
    "stream_bottom": 0.015,
    "stream_top": 0.08,
    "stream_rate": 600.0,
    "drop_velocity": 0.6,
    "settle_time": 0.15,
    "longest_settle_time": 0.2,
}

# The same as a user would type it, some with units.
SMALL_TYPED = [
    "particles=150",
    "cup_radius=20 mm",
    "rim_height=6mm",
    "stream_radius=1.2 cm",
    "stream_bottom=0.015",
    "stream_top=80 mm",
    "stream_rate=600 1/s",
    "drop_velocity=0.6 m/s",
    "settle_time=150 ms",
    "longest_settle_time=0.2",
]
