"""Pictures of the results folder, put into the page itself."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from taichidem.study.report.wording import spoken

WIDEST = 1400  # pixels; more helps nobody in a page and makes it too heavy to mail
SHRUNK_QUALITY = 90
DRAWN_HERE = ("waterfall", "look_alikes", "standardised_errors")  # the page draws these itself
FORMATS = {"PNG": "image/png", "JPEG": "image/jpeg", "GIF": "image/gif", "WEBP": "image/webp"}


@dataclass(frozen=True)
class Picture:
    """A picture of the page.

    Attributes:
        caption: for people, from its name.
        source: the picture as a data URL; empty where it can't be shown.
        width, height: in pixels.
        problem: why it can't be shown.
    """

    caption: str
    source: str = ""
    width: int = 0
    height: int = 0
    problem: str = ""


def pictures(named: Mapping[str, str], folder: Path) -> list[Picture]:
    """Return the pictures that a result names, those that the page draws itself left out; heaps come last.

    Args:
        named: paths relative to the folder, by name, as in comparison.json.
        folder: of the results. A file outside it is not put into the page.
    """
    wanted = {n: file for n, file in named.items() if not n.startswith(DRAWN_HERE)}
    return [_picture(n, wanted[n], folder) for n in sorted(wanted, key=lambda n: (n.startswith("heap"), n))]


def _picture(name: str, file: str, folder: Path) -> Picture:
    from PIL import Image, UnidentifiedImageError

    kind, _, test = name.partition("_")
    caption = f"{kind.capitalize()}: {spoken(test)}" if test else kind.capitalize()
    path = (folder / file).resolve()
    if not path.is_relative_to(folder.resolve()):
        return Picture(caption, problem=f"{file} lies outside the folder of results.")
    try:
        with Image.open(path) as image:
            image.load()
            mime = FORMATS.get(image.format or "")
            if mime and image.width <= WIDEST:
                return Picture(caption, _url(mime, path.read_bytes()), image.width, image.height)
            return _smaller(caption, image)
    except FileNotFoundError:
        return Picture(caption, problem=f"{file} is not there; run the command that made it again.")
    except (OSError, UnidentifiedImageError, ValueError, SyntaxError, Image.DecompressionBombError):
        return Picture(caption, problem=f"{file} is no picture that can be read.")


def _smaller(caption: str, image) -> Picture:
    shrunk = image.convert("RGB")
    shrunk.thumbnail((WIDEST, 4 * WIDEST))
    out = io.BytesIO()
    shrunk.save(out, format="WEBP", quality=SHRUNK_QUALITY)  # a heap of grains as PNG is seven times as heavy
    return Picture(caption, _url(FORMATS["WEBP"], out.getvalue()), shrunk.width, shrunk.height)


def _url(mime: str, content: bytes) -> str:
    return f"data:{mime};base64,{base64.b64encode(content).decode('ascii')}"
