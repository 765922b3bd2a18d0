"""Study folders and the store of their runs: read a study, run its experiments, keep every outcome, report what is known."""

from taichidem.study.addition import Addition
from taichidem.study.addition_run import add
from taichidem.study.calibrate_section import Calibration
from taichidem.study.campaign import run_all, simulate
from taichidem.study.coarse_graining_check import check_coarse_graining, check_study
from taichidem.study.coarse_graining_result import CoarseGrainingCheck
from taichidem.study.coarse_graining_writer import write_coarse_grained
from taichidem.study.comparison import Comparison
from taichidem.study.comparison_rows import comparison_rows, measured_parameters
from taichidem.study.comparison_run import check_measured, compare
from taichidem.study.diagnosis import Diagnosis
from taichidem.study.diagnosis_run import diagnose
from taichidem.study.discovery import Discovery, discover
from taichidem.study.execution import Run
from taichidem.study.init_study import init_study
from taichidem.study.measurements import read_measurements
from taichidem.study.parameter_key import ParameterKey, with_values
from taichidem.study.problems import FileError
from taichidem.study.report import write_report
from taichidem.study.run_store import RunStore, StoredRun
from taichidem.study.setting_key import SettingKey
from taichidem.study.study_file import Study, read_study
from taichidem.study.study_point import StudyPoint
from taichidem.study.summary import summarise
from taichidem.study.worker_processes import SpawnedProcesses

__all__ = [
    "Addition",
    "Calibration",
    "CoarseGrainingCheck",
    "Comparison",
    "Diagnosis",
    "Discovery",
    "FileError",
    "ParameterKey",
    "Run",
    "RunStore",
    "SettingKey",
    "SpawnedProcesses",
    "StoredRun",
    "Study",
    "StudyPoint",
    "add",
    "check_coarse_graining",
    "check_measured",
    "check_study",
    "compare",
    "comparison_rows",
    "diagnose",
    "discover",
    "init_study",
    "measured_parameters",
    "read_measurements",
    "read_study",
    "run_all",
    "simulate",
    "summarise",
    "with_values",
    "write_coarse_grained",
    "write_report",
]
