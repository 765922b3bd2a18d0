"""Write a study folder to fill in."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path

from taichidem import plugins
from taichidem.errors import InputError
from taichidem.starting_materials import starting_material
from taichidem.study import measurements
from taichidem.study.init_text import measurements_text, study_text
from taichidem.study.study_file import FILE, Study, read_study
from taichidem.units import to_si
from taichidem.whole_file import write_whole


def init_study(
    path: str | Path,
    experiments: Iterable[str],
    material: str = "polypropylene",
    wall: str = "steel",
    diameter: float | str = "6 mm",
) -> Study:
    """Write a commented study.toml and a measurements.csv to fill in, and return the study.

    Args:
        path: the folder, made where it doesn't exist.
        experiments: registered types, such as "ledge"; each becomes a test of that name.
        material, wall: starting materials of grains and walls.
        diameter: of the grains, a number [m] or a text; the defaults of the tests are scaled to it so that gravity acts alike.

    Raises:
        InputError: an unknown experiment or material (with the nearest), none given, a folder that holds a study already, or
            one that can't be written.
    """
    folder = Path(path)
    kinds = {name: plugins.get("experiment", name) for name in experiments}
    if not kinds:
        known = ", ".join(sorted(plugins.names("experiment")))
        raise InputError(f"No experiment was given; give one or more of: {known}.")
    size = to_si(diameter, "m", "diameter")
    if size <= 0:
        raise InputError(f"diameter is {diameter!r}; it must be above 0.")
    text = study_text(kinds, starting_material(material), starting_material(wall), size)
    table = measurements_text(_checked(text).at({}).experiments)
    _refuse_to_overwrite(folder, table)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # The study last: where it stands, the folder is complete.
        write_whole(folder / measurements.FILE, table)
        write_whole(folder / FILE, text)
    except OSError as error:
        raise InputError(
            f"The study can't be written to {folder} ({error.strerror}). Choose another folder."
        ) from error
    return read_study(folder)


def _refuse_to_overwrite(folder: Path, table: str) -> None:
    """Raise InputError where a study or measurements stand; an empty `table` alone is what a killed call of before left."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} is a file; give the name of a new folder.")
    for name in (FILE, measurements.FILE):
        own = name == measurements.FILE and _holds(folder / name, table)
        if (folder / name).exists() and not own:
            raise InputError(f"{folder / name} exists and is left as it is. Choose another folder, or remove it first.")


def _holds(path: Path, text: str) -> bool:
    return path.is_file() and path.read_text(encoding="utf-8", errors="replace") == text


def _checked(text: str) -> Study:
    """Return the study that a text makes, before anything is written where the user asked.

    Raises:
        InputError: an experiment can't be proposed, since it needs settings that nobody can guess.
    """
    with tempfile.TemporaryDirectory() as place:
        (Path(place) / FILE).write_text(text, encoding="utf-8")
        try:
            return read_study(place)
        except InputError as error:
            reasons = "\n".join(str(error).splitlines()[1:]) or str(error)
            raise InputError(
                "An experiment can't be proposed with these sizes; write its study by hand, or choose another diameter.\n"
                f"{reasons}"
            ) from error
