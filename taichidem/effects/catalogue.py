"""The page docs/effects.md, from what every effect declares: `python -m taichidem.effects.catalogue > docs/effects.md`."""

from __future__ import annotations

import inspect

from taichidem.effects import BUILT_IN
from taichidem.effects.base import BodyEffect, ContactEffect, Effect, Parameter

HEAD = """# Effects

Every effect is at once a force in the kernel, a factor in a design (`effect.parameter`) and a hypothesis about what a model
lacks. At the vanishing value of its parameters it does nothing. A model holds at most one effect of a family. This page is
written from the declarations in `taichidem/effects/`; how to add one is in [add_an_effect.md](add_an_effect.md), what each one
does to each test of the bench in [sensitivity.md](sensitivity.md).
"""
GROUPS = (
    ("Contact effects", ContactEffect),
    ("Body effects", BodyEffect),
    ("Set-up effects", Effect),
)


def as_markdown() -> str:
    """Return the page."""
    parts = [HEAD]
    left = dict(BUILT_IN)
    for title, base in GROUPS:
        kinds = [left.pop(name) for name in sorted(left) if issubclass(left[name], base)]
        parts += [f"## {title}\n", *(_section(kind) for kind in kinds)]
    return "\n".join(parts)


def _section(kind: type[Effect]) -> str:
    lines = [f"### `{kind.name}`: {kind.title}", "", *_paragraphs(kind), ""]
    lines += [
        "| parameter | unit | bounds | plausible | vanishes at | default | coarse graining | meaning |",
        "|---|---|---|---|---|---|---|---|",
        *(_row(p) for p in kind.parameters),
        "",
    ]
    facts = [f"Seen as: {kind.visible_as}."]
    if kind.family:
        facts.append(f"Family: `{kind.family}`.")
    for family, names in kind.needs.items():
        facts.append(f"Needs {' or '.join(f'`{n}`' for n in names) or f'an effect of family `{family}`'}.")
    if kind.shapes_reason:
        facts.append(f"Acts on {' and '.join(kind.shapes)} only, since {kind.shapes_reason}.")
    if kind.similarity is not None:
        facts.append(f"Coarse graining keeps: {kind.similarity.kept}.")
    return "\n".join([*lines, " ".join(facts), "", f"Source: {kind.source}.", ""])


def _paragraphs(kind: type[Effect]) -> list[str]:
    return (inspect.getdoc(kind) or "").splitlines()


def _row(p: Parameter) -> str:
    unit = "–" if p.unit == "1" else p.unit
    low = f"> {p.low:g}" if p.open_low else f"{p.low:g}"
    rule = {0.0: "kept"}.get(p.coarse_graining, f"× s^{p.coarse_graining:.3g}")
    cells = [f"`{p.name}`", unit, f"{low} to {p.high:g}", f"{p.plausible[0]:g} to {p.plausible[1]:g}"]
    cells += ["–" if p.vanishing is None else f"{p.vanishing:g}", "–" if p.default is None else f"{p.default:.4g}"]
    return "| " + " | ".join([*cells, rule, p.meaning]) + " |"


if __name__ == "__main__":
    print(as_markdown(), end="")
