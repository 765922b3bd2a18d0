"""Study folders and the store of their runs: read a study, run its experiments, keep every outcome, report what is known."""

from taichidem.study.campaign import Run, run_all, simulate
from taichidem.study.measurements import read_measurements
from taichidem.study.parameter_key import with_values
from taichidem.study.problems import FileError
from taichidem.study.report import write_report
from taichidem.study.run_store import RunStore, StoredRun
from taichidem.study.study_file import Study, read_study
from taichidem.study.summary import summarise

__all__ = [
    "FileError",
    "Run",
    "RunStore",
    "StoredRun",
    "Study",
    "read_measurements",
    "read_study",
    "run_all",
    "simulate",
    "summarise",
    "with_values",
    "write_report",
]
