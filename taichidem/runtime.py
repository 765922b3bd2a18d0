"""Start Taichi, once and in one place; the only module that calls `ti.init`.

Taichi has one runtime per process and a second `ti.init` destroys every field, so `start` may be called as often as one
likes but refuses to change what is already running. A process that has started Taichi must not fork: its child hangs at
its first kernel. Use the `spawn` start method. One thread per process may use it, the one that started it.
"""

import contextlib
import io
import os
import threading
from collections.abc import Iterator
from dataclasses import dataclass

os.environ.setdefault("TI_ENABLE_TORCH", "0")  # Taichi would otherwise import torch wherever it happens to be installed
os.environ.setdefault("TI_ENABLE_PADDLE", "0")

import taichi as ti

from taichidem.errors import EnvironmentProblem, InputError


@dataclass(frozen=True)
class Runtime:
    """The settings Taichi runs with in this process."""

    arch: str
    threads: int
    debug: bool


_running: Runtime | None = None
_thread: int | None = None  # that started it


def cores() -> int:
    """Return the number of processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def start(threads: int | None = None, arch: str | None = None, debug: bool | None = None) -> Runtime:
    """Start Taichi in double precision without fast-math, or return what already runs.

    Args:
        threads: worker threads of the CPU backend; by default `TAICHIDEM_THREADS`, else every processor allowed.
        arch: "cpu" or "cuda"; by default `TAICHIDEM_ARCH`, else "cpu".
        debug: check array bounds in kernels (slow); by default `TAICHIDEM_DEBUG`, else off.

    Raises:
        InputError: the settings are unknown, or differ from those of the runtime that is already up.
        EnvironmentProblem: CUDA was asked for and there is none, or another thread of this process started Taichi.
    """
    global _running, _thread
    if _running is not None:
        if threading.get_ident() != _thread:
            raise EnvironmentProblem(
                "Taichi was started by another thread of this process, and it crashes when a second one compiles for it. "
                "Simulate in that thread, or in processes of their own, as taichidem.study.SpawnedProcesses does."
            )
        _refuse_changes(threads, arch, debug)
        return _running
    wanted = _wanted(threads, arch, debug)
    _check_arch(wanted.arch)
    if wanted.threads < 1:
        raise InputError(f"threads is {wanted.threads}; give at least 1, or leave it out for every processor.")
    with contextlib.redirect_stdout(io.StringIO()):  # Taichi announces itself on standard output
        _init(wanted)
    if wanted.arch == "cuda" and ti.lang.impl.current_cfg().arch != ti.cuda:
        ti.reset()
        raise EnvironmentProblem(
            "arch='cuda' was asked for, but Taichi finds no usable CUDA device. Install its driver (nvidia-smi must list it), "
            "or leave arch out for the CPU."
        )
    _running, _thread = wanted, threading.get_ident()
    return wanted


def in_use() -> Runtime:
    """Return the settings that Taichi runs with, or would run with if it were started now; starts nothing."""
    return _running or _wanted(None, None, None)


def _wanted(threads: int | None, arch: str | None, debug: bool | None) -> Runtime:
    return Runtime(
        arch=arch or os.environ.get("TAICHIDEM_ARCH") or "cpu",  # an empty variable is none
        threads=threads or _number_from("TAICHIDEM_THREADS") or cores(),
        debug=bool(_number_from("TAICHIDEM_DEBUG")) if debug is None else debug,
    )


@contextlib.contextmanager
def compiling_by_llvm_alone() -> Iterator[None]:
    """Compile what is called for the first time inside without Taichi's own optimisations.

    Its passes grow faster than linearly with the kernel: a law with the search between superquadrics compiles in 7 s instead of
    20 s without them, and runs 7 % faster. Spheres run 7 % slower without, so they are left on.
    """
    config = ti.lang.impl.current_cfg()
    usual = config.advanced_optimization
    config.advanced_optimization = False
    try:
        yield
    finally:
        config.advanced_optimization = usual


def choose(arch: str) -> None:
    """Say on what Taichi will run when it is needed, here and in the processes that this one starts.

    Raises:
        InputError: an unknown name, or another than what already runs.
    """
    _check_arch(arch)
    if _running is not None:
        _refuse_changes(None, arch, None)
    os.environ["TAICHIDEM_ARCH"] = arch


def _check_arch(arch: str) -> None:
    if arch not in ("cpu", "cuda"):
        raise InputError(f"arch is {arch!r}; allowed are 'cpu' and 'cuda'. Leave it out for the CPU.")


def _number_from(variable: str) -> int:
    text = os.environ.get(variable) or "0"
    if not text.isdigit():
        raise InputError(f"The environment variable {variable} is {text!r}; give a whole number from 0, or unset it.")
    return int(text)


def _init(wanted: Runtime) -> None:
    ti.init(
        arch=getattr(ti, wanted.arch),
        default_fp=ti.f64,
        fast_math=False,  # fast-math would hide NaN and let two schedules differ in the last bit
        cpu_max_num_threads=wanted.threads,
        debug=wanted.debug,
        log_level=ti.WARN,
        offline_cache=True,
        # Taichi's own control-flow pass grows faster than linearly with the kernel (12 s instead of 3 s for a full law)
        # and gains nothing measurable that LLVM does not find by itself.
        cfg_optimization=False,
        unrolling_limit=0,  # wide tables are unrolled column by column, on purpose
    )


def _refuse_changes(threads: int | None, arch: str | None, debug: bool | None) -> None:
    asked = {"threads": threads, "arch": arch, "debug": debug}
    for name, value in asked.items():
        now = getattr(_running, name)
        if value is not None and value != now:
            raise InputError(
                f"{name}={value!r} was asked for, but Taichi already runs with {name}={now!r}. One process has one "
                "runtime: call taichidem.runtime.start first, or use a new process."
            )
