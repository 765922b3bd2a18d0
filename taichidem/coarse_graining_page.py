"""The tables of rules in docs/coarse_graining.md: `python -m taichidem.coarse_graining_page docs/coarse_graining.md`."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from taichidem.coarse_graining import GENERAL, rule_text
from taichidem.effects import BUILT_IN
from taichidem.effects.base import Effect, SetupEffect
from taichidem.experiments import BUILT_IN as EXPERIMENTS

START, END = "<!-- rules: written by python -m taichidem.coarse_graining_page -->", "<!-- end of the rules -->"


def as_markdown() -> str:
    """Return the tables: what holds for every model, the rules of effects, those of experiments' settings."""
    return "\n".join(
        [
            START,
            "",
            "| in every model | rule | keeps |",
            "|---|---|---|",
            *(f"| {rule.quantity} [{rule.unit}] | {rule_text(rule.exponent)} | {rule.keeps} |" for rule in GENERAL),
            "",
            "| effect | parameters that change | keeps |",
            "|---|---|---|",
            *(_effect_row(BUILT_IN[name]) for name in sorted(BUILT_IN)),
            "",
            "| experiment | settings that change; all others belong to the apparatus and stay |",
            "|---|---|",
            *(_experiment_row(name) for name in EXPERIMENTS),
            "",
            END,
        ]
    )


def _effect_row(kind: type[Effect]) -> str:
    changing = [f"`{p.name}` {rule_text(p.coarse_graining)}" for p in kind.parameters if p.coarse_graining]
    keeps = kind.similarity.kept if kind.similarity else "shares and angles" if issubclass(kind, SetupEffect) else "–"
    return f"| `{kind.name}` | {', '.join(changing) or 'none'} | {keeps} |"


def _experiment_row(name: str) -> str:
    return f"| `{name}` | {', '.join(_changing(name))} |"


def _changing(name: str) -> Iterator[str]:
    for setting, declared in EXPERIMENTS[name].settings_type.model_fields.items():
        extra = declared.json_schema_extra
        power = extra.get("coarse_graining", 0.0) if isinstance(extra, dict) else 0.0
        if power:
            yield f"`{setting}` {rule_text(float(power))}"  # type: ignore[arg-type]


def rewritten(page: str) -> str:
    """Return a page with its tables written anew."""
    before, _, rest = page.partition(START)
    return before + as_markdown() + rest.partition(END)[2]


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(rewritten(path.read_text(encoding="utf-8")), encoding="utf-8")
