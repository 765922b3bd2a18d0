"""Study folders and the store of their runs: read a study, run its experiments, keep every outcome, report what is known."""

from taichidem.study.campaign import Run, run_all, simulate
from taichidem.study.comparison import Comparison
from taichidem.study.comparison_rows import comparison_rows, measured_parameters
from taichidem.study.comparison_run import check_measured, compare
from taichidem.study.measurements import read_measurements
from taichidem.study.parameter_key import with_values
from taichidem.study.problems import FileError
from taichidem.study.report import write_report
from taichidem.study.run_store import RunStore, StoredRun
from taichidem.study.study_file import Study, read_study
from taichidem.study.summary import summarise

__all__ = [
    "Comparison",
    "FileError",
    "Run",
    "RunStore",
    "StoredRun",
    "Study",
    "check_measured",
    "compare",
    "comparison_rows",
    "measured_parameters",
    "read_measurements",
    "read_study",
    "run_all",
    "simulate",
    "summarise",
    "with_values",
    "write_report",
]
