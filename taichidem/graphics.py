"""Find out, without risking the user's process, whether VTK can draw off screen here.

Where neither an X server nor EGL nor OSMesa is at hand, VTK 9.7 doesn't raise: it warns and then
crashes with a segmentation fault at the first picture. So the first picture is drawn in a child process,
once, with each kind of window in turn; the kind that works is then chosen for this process too.
"""

from __future__ import annotations

import functools
import os
import subprocess
import sys

from taichidem.errors import EnvironmentProblem

CHOICE = "VTK_DEFAULT_OPENGL_WINDOW"
PROBE_SECONDS = 60
PROBE = """
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow
from vtkmodules.vtkRenderingCore import vtkWindowToImageFilter
source, mapper, actor = vtkSphereSource(), vtkPolyDataMapper(), vtkActor()
renderer, window, grab = vtkRenderer(), vtkRenderWindow(), vtkWindowToImageFilter()
mapper.SetInputConnection(source.GetOutputPort())
actor.SetMapper(mapper)
renderer.AddActor(actor)
window.SetOffScreenRendering(1)
window.SetSize(64, 64)
window.AddRenderer(renderer)
window.Render()
grab.SetInput(window)
grab.Update()
low, high = grab.GetOutput().GetScalarRange()
print("drawn", window.GetClassName() if high - low > 50 else "")
"""


@functools.lru_cache(maxsize=1)
def require_graphics() -> None:
    """Make sure that VTK can draw off screen, and choose the kind of window that does.

    Raises
    ------
    EnvironmentProblem : PyVista or an OpenGL library is missing; the message names the cure.
    """
    if not sys.executable:
        # An embedded interpreter can't start itself again; VTK is then trusted.
        return
    said = []
    for window in _windows():
        drawn, outcome = _try_window(window)
        if drawn:
            # VTK falls back by itself, with warnings: what it ended with is asked for at once from now on.
            if window:
                os.environ[CHOICE] = drawn
            return
        said.append(f"{window or os.environ.get(CHOICE) or 'the default window'} ({outcome})")
    raise EnvironmentProblem(_message(said))


def _windows() -> tuple[str, ...]:
    """Return the kinds of window worth trying, the likeliest first; "" leaves the choice to VTK."""
    if os.environ.get(CHOICE):
        return ("",)
    if not sys.platform.startswith("linux"):
        return ("",)
    # EGL first even beside an X server: it needs no display, and doesn't die with one.
    return ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow") + (("",) if os.environ.get("DISPLAY") else ())


def _try_window(window: str) -> tuple[str, str]:
    """Draw a sphere in a child process; return the kind of window that did, or "", and what happened else."""
    environment = dict(os.environ)
    if window:
        environment[CHOICE] = window
    try:
        done = subprocess.run(
            [sys.executable, "-c", PROBE],
            env=environment,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=PROBE_SECONDS,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as problem:
        return "", str(problem)
    words = done.stdout.split()
    if done.returncode == 0 and len(words) == 2:
        return words[1], ""
    if done.returncode < 0:
        return "", f"VTK crashed with signal {-done.returncode}"
    return "", done.stderr.strip().splitlines()[
        -1
    ] if done.returncode and done.stderr.strip() else "the picture was blank"


def _message(said: list[str]) -> str:
    return (
        "No picture can be drawn here: VTK finds no OpenGL library that works without a screen. "
        f"Tried: {', '.join(said)}. Needed: PyVista with VTK 9.4 or newer, and EGL or OSMesa with a software driver. "
        "Cure on Debian or Ubuntu: apt-get install --no-install-recommends libegl1 libgl1 libgl1-mesa-dri. "
        "On Fedora: dnf install mesa-libEGL mesa-dri-drivers. "
        'With conda: conda install -c conda-forge "vtk>=9.4" "mesalib<25.1". '
        'With pip: pip install --upgrade "vtk>=9.4" pyvista (the old vtk-osmesa wheels end at 9.3).'
    )
