"""Read what lies in a study's folder of results."""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from taichidem.errors import InputError
from taichidem.study.report.result_schema import KINDS, complete
from taichidem.study.result_file import ResultFile

COMMANDS = {
    "comparison": "compare {study}",
    "verdict": "diagnose {study}",
    "addition": "add OLD_STUDY EFFECT -o {study}",
    "discovery": "discover {study}",
}
MOST_PROBLEMS = 3  # told of one file; the first few show what is wrong with it


@dataclass(frozen=True)
class Results:
    """The results that were found.

    Attributes:
        folder: where they lie.
        documents: content by kind (comparison, verdict, addition, discovery), each complete; only those that exist.
        written: when each file was written, by kind.
    """

    folder: Path
    documents: dict[str, dict[str, Any]]
    written: dict[str, datetime]

    def get(self, kind: str) -> dict[str, Any] | None:
        """Return a result, or None where its file is missing."""
        return self.documents.get(kind)


def read_results(folder: Path, study: str) -> Results:
    """Read every result file of a folder.

    Args:
        folder: the folder of results.
        study: name of the study, for the commands in messages.

    Raises:
        InputError: there is no result at all, or a file is broken or of another format.
    """
    files = {kind: folder / f"{kind}.json" for kind in KINDS}
    found = {kind: file for kind, file in files.items() if file.is_file()}
    if not found:
        raise InputError(
            f"There is none of {', '.join(f.name for f in files.values())} in {folder}. "
            f"Run `taichidem compare {study}` or `taichidem diagnose {study}` first, or name the folder with --results."
        )
    documents = {kind: _read(kind, file, study) for kind, file in found.items()}
    return Results(folder, documents, {kind: datetime.fromtimestamp(f.stat().st_mtime) for kind, f in found.items()})


def _read(kind: str, file: Path, study: str) -> dict[str, Any]:
    again = f"Make it anew with `taichidem {COMMANDS[kind].format(study=study)}`."
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{file} can't be read ({error.strerror}).") from error
    except ValueError as error:  # neither UTF-8 nor JSON
        raise InputError(f"{file} is not valid JSON ({error}). {again}") from error
    if not isinstance(document, dict):
        raise InputError(f"{file} holds no JSON object. {again}")
    if document.get("schema") != ResultFile.schema:
        raise InputError(
            f"{file} has schema {document.get('schema')!r:.60}; this version reads {ResultFile.schema}. "
            f"A newer file needs a newer taichidem. {again}"
        )
    try:
        return complete(kind, document)
    except ValidationError as error:
        raise InputError(f"{file} can't be used: {_told(error)}. {again}") from error


def _told(error: ValidationError) -> str:
    problems = error.errors(include_url=False)
    told = [f"{'.'.join(map(str, p['loc']))} is {p['input']!r:.60} ({p['msg']})" for p in problems[:MOST_PROBLEMS]]
    return "; ".join(told) + (f"; and {len(problems) - MOST_PROBLEMS} more" if len(problems) > MOST_PROBLEMS else "")
