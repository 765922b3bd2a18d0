"""The registries of designs, analysers, effects and experiments: built-in ones and those of installed packages.

An outside package declares one entry point per plugin in its ``pyproject.toml``::

    [project.entry-points."taichidem.designs"]
    my_design = "my_package.my_module:MyDesign"

From then on it is equal to the built-in ones in the API, the CLI and ``taichidem plugins``. A plugin that can't be
imported is reported and skipped; a name that is taken is refused.
"""

from __future__ import annotations

import functools
import importlib
import importlib.util
import inspect
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from taichidem.errors import InputError, unknown_name


@dataclass(frozen=True)
class _Kind:
    """One kind of plugin: entry-point group, module with the table BUILT_IN, and the base class it must have."""

    group: str
    module: str
    base: str | None = None


KINDS: Mapping[str, _Kind] = {
    "design": _Kind("taichidem.designs", "designs", "designs.base:DesignGenerator"),
    "analyser": _Kind("taichidem.analysers", "analysis", "analysis.base:Analyser"),
    "effect": _Kind("taichidem.effects", "taichidem.effects", "taichidem.effects.base:Effect"),
    "experiment": _Kind("taichidem.experiments", "taichidem.experiments", "taichidem.experiments.base:Experiment"),
}

#: The source of built-in plugins.
OURS = "taichidem"


@dataclass(frozen=True)
class Plugin:
    """One entry of a registry.

    Args:
        kind: ``design``, ``analyser``, ``effect`` or ``experiment``.
        name: the name people type.
        source: the distribution it came with.
        summary: the first line of its docstring.
        status: ``ok``, or the reason why it can't be used.
    """

    kind: str
    name: str
    source: str
    summary: str
    status: str = "ok"
    target: Any = field(default=None, repr=False, compare=False)

    @property
    def usable(self) -> bool:
        """Whether ``get`` returns it."""
        return self.status == "ok"


def listing(kind: str | None = None) -> list[Plugin]:
    """Return all plugins of one kind, or of all kinds, built-in ones first, those with problems included.

    Raises:
        InputError: for a kind that doesn't exist.
    """
    return [plugin for one in ([kind] if kind else KINDS) for plugin in _registry(one)]


def names(kind: str) -> list[str]:
    """Return the names that ``get`` accepts."""
    return [plugin.name for plugin in _registry(kind) if plugin.usable]


def problems(kind: str) -> list[str]:
    """Return one sentence for each plugin that was skipped or refused."""
    return [f"{kind} {p.name!r} of {p.source} is not available: {p.status}" for p in _registry(kind) if not p.usable]


def get(kind: str, name: str) -> Any:
    """Return the class registered under a name.

    Raises:
        InputError: for an unknown name (with the nearest), or one whose plugin is broken or refused (with the reason).
    """
    found = [plugin for plugin in _registry(kind) if plugin.name == name]
    for plugin in found:
        if plugin.usable:
            return plugin.target
    if found:
        raise InputError(f"The {kind} {name!r} of {found[0].source} can't be used: {found[0].status}")
    raise unknown_name(kind, name, names(kind))


def refresh() -> None:
    """Forget what was found, so that packages installed meanwhile are seen."""
    importlib.invalidate_caches()
    _registry.cache_clear()


@functools.cache
def _registry(kind: str) -> tuple[Plugin, ...]:
    if kind not in KINDS:
        raise unknown_name("kind of plugin", kind, KINDS)
    return tuple(_without_duplicates([*_built_in(kind), *_outside(kind)]))


def _built_in(kind: str) -> Iterator[Plugin]:
    module_name = KINDS[kind].module
    if importlib.util.find_spec(module_name) is None:
        return
    module = importlib.import_module(module_name)
    table = getattr(module, "BUILT_IN", None)
    if table is None:
        place = getattr(module, "__file__", None) or next(iter(getattr(module, "__path__", ["?"])))
        raise InputError(
            f"Python found the package {module_name!r} in {place}, which isn't the one of taichidem: a folder or file "
            "of that name shadows it. Rename yours, or start Python in another folder."
        )
    for name, target in table.items():
        target = _imported(target) if isinstance(target, str) else target
        yield Plugin(kind, name, OURS, _summary(target), target=target)


def _outside(kind: str) -> Iterator[Plugin]:
    seen = set()
    for point in sorted(entry_points(group=KINDS[kind].group), key=lambda p: (p.name, p.value)):
        source = point.dist.name if point.dist is not None else "an unknown distribution"
        # A distribution that is found twice on the path (installed and editable) declares the same plugin twice.
        if (point.name, point.value, source) not in seen:
            seen.add((point.name, point.value, source))
            yield _loaded(kind, point, source)


def _loaded(kind: str, point: EntryPoint, source: str) -> Plugin:
    try:
        target = point.load()
    except (Exception, SystemExit) as error:  # whatever a foreign module does at import, ours must go on
        return Plugin(kind, point.name, source, "", f"{point.value} can't be imported: {type(error).__name__}: {error}")
    fault = _fault(kind, point.name, target)
    return Plugin(kind, point.name, source, _summary(target), fault or "ok", target)


def _fault(kind: str, name: str, target: Any) -> str:
    """Return what is wrong with a plugin that was imported, or nothing."""
    base = KINDS[kind].base
    if base is not None:
        wanted = _imported(base)
        if not (inspect.isclass(target) and issubclass(target, wanted)):
            return f"{target!r} is no subclass of {base.replace(':', '.')}."
        if inspect.isabstract(target):
            missing = ", ".join(sorted(getattr(target, "__abstractmethods__", ())))
            return f"{target.__name__} doesn't define {missing}."
    declared = getattr(target, "name", name)
    if declared != name:
        return f"the entry point is called {name!r} but the class says name = {declared!r}; make them equal."
    return ""


def _without_duplicates(plugins: list[Plugin]) -> Iterator[Plugin]:
    """Yield the plugins, those whose name is taken marked as refused; a built-in one keeps its name."""
    for plugin in plugins:
        rivals = [p for p in plugins if p.name == plugin.name and p is not plugin]
        if plugin.source == OURS or not rivals or not plugin.usable:
            yield plugin
            continue
        others = ", ".join(sorted({rival.source for rival in rivals}))
        status = f"the name is taken: {plugin.source} and {others} both declare it. Rename or uninstall one."
        yield Plugin(plugin.kind, plugin.name, plugin.source, plugin.summary, status)


def _imported(target: str) -> Any:
    module, _, attribute = target.partition(":")
    return getattr(importlib.import_module(module), attribute)


def _summary(target: Any) -> str:
    return next(iter((inspect.getdoc(target) or "").splitlines()), "")
