"""Write grains and walls as files that ParaView opens: .vtp for a moment, .pvd for a series in time.

A file of grains holds one point for each sphere or superquadric. In ParaView show

- spheres and clumps as "Point Gaussian", or as "3D Glyphs" of type Sphere with scale array `radius`, scale factor 2. A clump is
  as many points as it has spheres; the array `body` says which grain each belongs to.
- ellipsoids as "3D Glyphs" of type Sphere, scale mode "Scale by Vector Components" with the array `axes`, scale factor 2,
  orientation mode "Quaternion" with the array `orientation`.
- superquadrics of any exponents, and whatever should be cut, measured or shown elsewhere, from the file of
  `write_grain_surfaces`: triangles that need no settings.

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
from taichidem.grains import Grains
from taichidem.render_grains import grain_mesh
from taichidem.render_walls import Wall, wall_surfaces
from taichidem.shapes.forms import Forms
from taichidem.snapshot import Snapshot
from taichidem.whole_file import whole_file, write_whole

# Name in the file, width of one entry (0 a number), kind.
FIELDS: dict[str, tuple[int, Any]] = {
    "velocity": (3, np.float64),
    "angular_velocity": (3, np.float64),
    "identifier": (0, np.int64),
    "material": (0, np.int64),
}
#: Arrays that say what the grains are; they are written from the grains themselves.
OWN = ("radius", "body", "offset", "orientation", "axes", "exponents")


def write_grains(
    path: str | os.PathLike[str],
    grains: Grains | Snapshot,
    *,
    fields: Mapping[str, Any] | None = None,
    time: float | None = None,
) -> Path:
    """Write grains as VTK polygonal data, one point for each sphere or superquadric.

    Points hold the array radius [m], that of the sphere or of the sphere about a superquadric. Where grains are more than
    single spheres they also hold body, the number of the grain from 0, orientation, quaternions w, x, y, z, and offset
    from the grain's centre in its own frame [m]; superquadrics hold axes, their semi-axes [m], and exponents, n₁ and n₂.

    Parameters
    ----------
    path : file to write, ending in .vtp.
    grains : of any form, such as those of a snapshot, or `Grains.spheres(positions, radii)`.
    fields : more arrays by name: velocity [m/s] (n, 3), angular_velocity [rad/s] (n, 3), identifier (n,),
        material (n,); any other name with n numbers or n rows of numbers, one for each grain.
    time : moment of the simulation [s], kept as the field TimeValue.

    Raises
    ------
    InputError : wrong shapes, an ending other than .vtp, or a file that can't be written.
    """
    grains = Grains.of(grains)
    points = pv.PolyData(grains.element_centre)
    for name, values in _own(grains).items():
        points.point_data[name] = values
    for name, values in (fields or {}).items():
        points.point_data[name] = _field(name, values, len(grains))[grains.forms.body]
    return _save(_at(points, time), path)


def read_grains(path: str | os.PathLike[str]) -> Grains:
    """Return the grains of a file of `write_grains`, as they were.

    Raises
    ------
    InputError : no such file, or one without grains.
    """
    if not Path(path).is_file():
        raise InputError(f"{path} isn't there. Give a file that `write_grains` wrote.")
    read = pv.read(path)
    held = {name: np.asarray(read.point_data[name]) for name in OWN if name in read.point_data}
    if "radius" not in held:
        raise InputError(f"{path} holds no grains: it lacks the array radius. Give a file that `write_grains` wrote.")
    if "body" not in held:
        return Grains.spheres(read.points, held["radius"])
    forms = Forms(*(held.get(name) for name in ("body", "offset", "radius", "axes", "exponents")))  # type: ignore[arg-type]
    first = np.unique(forms.body, return_index=True)[1]
    # As if every element were a grain of its own, to turn the offsets back.
    away = Grains(np.zeros((len(first), 3)), forms, held["orientation"][first]).element_centre
    return Grains((np.asarray(read.points, float) - away)[first], forms, held["orientation"][first])


def write_grain_surfaces(
    path: str | os.PathLike[str],
    grains: Grains | Snapshot,
    *,
    fields: Mapping[str, Any] | None = None,
    time: float | None = None,
    fineness: int | None = None,
) -> Path:
    """Write the surfaces of grains as triangles, which any program shows as they are.

    The point array body holds the number of the grain, Normals the normals of the exact surface. Clumps are written as all
    their spheres. Files are large: 300 kB for each element of a few grains, 20 kB for each of ten thousand.

    Parameters
    ----------
    path, grains, fields, time : as in `write_grains`.
    fineness : k; every element has 8 k points around and 4 k from pole to pole. None suits it to their number.

    Raises
    ------
    InputError : wrong shapes, an ending other than .vtp, or a file that can't be written.
    """
    grains = Grains.of(grains)
    mesh = grain_mesh(grains, fineness)
    for name, values in (fields or {}).items():
        mesh.point_data[name] = _field(name, values, len(grains))[mesh.point_data["body"]]
    return _save(_at(mesh, time), path)


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

    def add(self, time: float, grains: Grains | Snapshot, *, fields: Mapping[str, Any] | None = None) -> Path:
        """Write one moment; see `write_grains`. Raises InputError where `time` doesn't increase."""
        if not np.isfinite(time) or (self.times and time <= self.times[-1]):
            last = f"above {self.times[-1]}" if self.times else "finite"
            raise InputError(f"time given: {time}. Allowed: {last}, in seconds; moments are added in order.")
        path = write_grains(self._member(len(self.times)), grains, fields=fields, time=time)
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
        try:
            write_whole(self.index, "\n".join(lines))
        except OSError as problem:
            raise _unwritable(self.index, problem) from problem


def _own(grains: Grains) -> dict[str, NDArray[Any]]:
    """Return the arrays that say what grains are: the radius alone where all are single spheres."""
    forms = grains.forms
    own = {"radius": np.asarray(forms.radius, float)}
    if forms.round:
        return own
    own |= {"body": np.asarray(forms.body, np.int64), "offset": np.asarray(forms.offset, float)}
    own |= {"orientation": grains.element_orientation}
    if forms.axes is not None:
        own |= {"axes": grains.element_axes, "exponents": grains.element_exponents}
    return own


def _at(data: pv.PolyData, time: float | None) -> pv.PolyData:
    if time is not None:
        data.field_data["TimeValue"] = np.array([float(time)])
    return data


def _field(name: str, values: Any, count: int) -> NDArray[Any]:
    if name in OWN:
        raise InputError(f"{name} given as a field. It is written from the grains themselves; leave it out.")
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
    target = Path(path)
    if target.suffix != ".vtp":
        raise InputError(f"File given: {target}. Allowed: a name that ends in .vtp.")
    try:
        with whole_file(target) as fresh:
            data.save(fresh, binary=True)
    except OSError as problem:
        raise _unwritable(target, problem) from problem
    return target


def _unwritable(path: Path, problem: OSError) -> InputError:
    return InputError(
        f"{path} can't be written ({problem.strerror or problem}). Allowed: a place in a folder that exists and may be "
        "written to, on a disk with room. Choose another one."
    )
