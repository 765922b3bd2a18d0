"""Study folders and the store of their runs: read a study, run its experiments, keep every outcome."""

from taichidem.study.calibrate_section import Calibration
from taichidem.study.campaign import Run, run_all, simulate
from taichidem.study.init_study import init_study
from taichidem.study.measurements import read_measurements
from taichidem.study.parameter_key import ParameterKey, with_values
from taichidem.study.problems import FileError
from taichidem.study.run_store import RunStore, StoredRun
from taichidem.study.setting_key import SettingKey
from taichidem.study.study_file import Study, read_study
from taichidem.study.study_point import StudyPoint
from taichidem.study.summary import summarise

__all__ = [
    "Calibration",
    "FileError",
    "ParameterKey",
    "Run",
    "RunStore",
    "SettingKey",
    "StoredRun",
    "Study",
    "StudyPoint",
    "init_study",
    "read_measurements",
    "read_study",
    "run_all",
    "simulate",
    "summarise",
    "with_values",
]
