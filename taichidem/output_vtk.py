"""Write grains and walls as files that ParaView opens: .vtp for a moment, .pvd for a series in time.

In ParaView show the grains as "Point Gaussian" (or as "Glyph", sphere) scaled by the array `radius`.
No picture is drawn here, so this works without any OpenGL library.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from taichidem.errors import InputError
from taichidem.render_grains import check_grains
from taichidem.render_walls import Wall, wall_surfaces

# Name in the file, width of one entry (0 a number), kind.
FIELDS: dict[str, tuple[int, Any]] = {
    "velocity": (3, np.float64),
    "angular_velocity": (3, np.float64),
    "identifier": (0, np.int64),
    "material": (0, np.int64),
    "orientation": (4, np.float64),
}


def write_grains(
    path: str | os.PathLike[str],
    positions: Any,
    radii: Any,
    *,
    fields: Mapping[str, Any] | None = None,
    time: float | None = None,
) -> Path:
    """Write grains as VTK polygonal data, one point each.

    Parameters
    ----------
    path : file to write, ending in .vtp.
    positions : centres [m], shape (n, 3).
    radii : radii [m], shape (n,), or one number.
    fields : more arrays by name: velocity [m/s] (n, 3), angular_velocity [rad/s] (n, 3), identifier (n,),
        material (n,), orientation (n, 4) as quaternions w, x, y, z; any other name with n numbers or
        n rows of numbers.
    time : moment of the simulation [s], kept as the field TimeValue.

    Raises
    ------
    InputError : wrong shapes, an ending other than .vtp, or a file that can't be written.
    """
    places, sizes = check_grains(positions, radii)
    points = pv.PolyData(places)
    points.point_data["radius"] = sizes
    for name, values in (fields or {}).items():
        points.point_data[name] = _field(name, values, len(places))
    if time is not None:
        points.field_data["TimeValue"] = np.array([float(time)])
    return _save(points, path)


def write_walls(path: str | os.PathLike[str], walls: Iterable[Wall]) -> Path:
    """Write walls as one surface; the cell array `wall` numbers them from 0.

    Parameters
    ----------
    path : file to write, ending in .vtp.
    walls : walls of a scene, or surfaces.

    Raises
    ------
    InputError : no wall, a wrong description, or a file that can't be written.
    """
    surfaces = [surface.copy() for surface in wall_surfaces(walls)]
    if not surfaces:
        raise InputError("walls given: none. Allowed: one wall or more.")
    for number, surface in enumerate(surfaces):
        surface.clear_data()
        surface.cell_data["wall"] = np.full(surface.n_cells, number, dtype=np.int64)
    return _save(_joined(surfaces), path)


class GrainSeries:
    """A series in time: one .vtp a moment and a .pvd that names them, up to date after each.

    Parameters
    ----------
    folder : where the files go; made if it isn't there.
    name : start of the file names: name.pvd, name_000000.vtp …

    Raises
    ------
    InputError : the folder can't be made or written to.
    """

    def __init__(self, folder: str | os.PathLike[str], name: str = "grains") -> None:
        self.folder = Path(folder)
        self.name = name
        self.times: list[float] = []
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as problem:
            raise _unwritable(self.folder, problem) from problem
        self._write_index()

    @property
    def index(self) -> Path:
        """The .pvd file, which ParaView opens."""
        return self.folder / f"{self.name}.pvd"

    def add(self, time: float, positions: Any, radii: Any, *, fields: Mapping[str, Any] | None = None) -> Path:
        """Write one moment; see `write_grains`. Raises InputError where `time` doesn't increase."""
        if not np.isfinite(time) or (self.times and time <= self.times[-1]):
            last = f"above {self.times[-1]}" if self.times else "finite"
            raise InputError(f"time given: {time}. Allowed: {last}, in seconds; moments are added in order.")
        path = write_grains(self._member(len(self.times)), positions, radii, fields=fields, time=time)
        self.times.append(float(time))
        self._write_index()
        return path

    def _member(self, number: int) -> Path:
        return self.folder / f"{self.name}_{number:06d}.vtp"

    def _write_index(self) -> None:
        members = [
            f'    <DataSet timestep="{time!r}" group="" part="0" file={quoteattr(self._member(number).name)}/>'
            for number, time in enumerate(self.times)
        ]
        lines = [
            '<?xml version="1.0"?>',
            '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">',
            "  <Collection>",
            *members,
            "  </Collection>",
            "</VTKFile>",
            "",
        ]
        fresh = self.index.with_suffix(".pvd.part")
        try:
            fresh.write_text("\n".join(lines), encoding="utf-8")
            fresh.replace(self.index)
        except OSError as problem:
            raise _unwritable(self.index, problem) from problem


def _field(name: str, values: Any, count: int) -> NDArray[Any]:
    array = np.asarray(values)
    width, kind = FIELDS.get(name, (array.shape[1] if array.ndim == 2 else 0, array.dtype))
    shape = (count, width) if width else (count,)
    if array.shape != shape or array.dtype.kind not in "biuf":
        raise InputError(f"{name} given: {array.dtype}, shape {array.shape}. Allowed: numbers of shape {shape}.")
    return np.ascontiguousarray(array, dtype=kind)


def _joined(surfaces: list[pv.PolyData]) -> pv.PolyData:
    from vtkmodules.vtkFiltersCore import vtkAppendPolyData

    append = vtkAppendPolyData()
    for surface in surfaces:
        append.AddInputData(surface)
    append.Update()
    return pv.wrap(append.GetOutput())


def _save(data: pv.PolyData, path: str | os.PathLike[str]) -> Path:
    """Write under another name and rename, so that a file is whole or not there."""
    target = Path(path)
    if target.suffix != ".vtp":
        raise InputError(f"File given: {target}. Allowed: a name that ends in .vtp.")
    fresh = target.with_name(f".{target.stem}.part.vtp")
    try:
        data.save(fresh, binary=True)
        fresh.replace(target)
    except OSError as problem:
        raise _unwritable(target, problem) from problem
    return target


def _unwritable(path: Path, problem: OSError) -> InputError:
    return InputError(
        f"{path} can't be written ({problem.strerror or problem}). Allowed: a place in a folder that exists and may be "
        "written to, on a disk with room. Choose another one."
    )
