"""Reading measurements.csv."""

from __future__ import annotations

import math

import pandas as pd
import pytest

from taichidem.errors import InputError
from taichidem.study import FileError, read_measurements, read_study, summarise
from tests.study.fakes import MEASUREMENTS


def test_values_come_in_the_unit_of_the_observable(study):
    table = read_measurements(study)
    assert list(table.columns) == ["experiment", "observable", "value", "u", "unit", "n", "remark"]
    assert list(table["experiment"]) == ["narrow", "narrow", "wide"]
    assert list(table["observable"]) == ["angle", "flow", "angle"]
    assert list(table["unit"]) == ["deg", "g/s", "deg"]
    assert list(table["value"]) == pytest.approx([12.5, 40.0, math.degrees(0.2)])
    assert list(table["u"]) == pytest.approx([0.5, 2.0, math.degrees(0.01)])
    assert list(table["n"]) == [4, 3, 1]
    assert table["n"].dtype.kind == "i"
    assert list(table["remark"]) == ["by hand", "", ""]


def test_spaces_blank_lines_and_a_byte_order_mark_do_no_harm(write):
    text = "\ufeff" + MEASUREMENTS.replace(",", " , ").replace("wide", "\n\n  wide").replace("by hand", '"by, hand"')
    table = read_measurements(read_study(write(measurements=text)))
    assert list(table["value"]) == pytest.approx([12.5, 40.0, math.degrees(0.2)])
    assert table["remark"][0] == "by, hand"


def test_blank_lines_are_counted(write):
    study = read_study(write(measurements=MEASUREMENTS.replace("wide", "\n\nwid")))
    with pytest.raises(FileError, match="line 6: Unknown experiment"):
        read_measurements(study)


def test_a_further_column_tells_conditions_apart(write):
    text = "experiment,observable,value,u,unit,n,time\nwide,angle,1,0.1,deg,1,0.5\nwide,angle,2,0.1,deg,1,1.0\n"
    table = read_measurements(read_study(write(measurements=text)))
    assert list(table["time"]) == ["0.5", "1.0"]


FALL = """
[experiments.fall]
type = "free_fall"
release_height = 10
time = ["250 ms", 0.5, 1]
[experiments.drop]
type = "free_fall"
time = 0.3
"""
SERIES = "experiment,observable,value,u,unit,n,time,drop\n"


def test_a_height_at_a_time_is_the_response_of_that_time(write):
    rows = [
        "fall,height,980,1,cm,2,0.25,1",
        "fall,height,9.7,0.1,m,2,0.25,2",
        "fall,height,5,0.1,m,2,1000 ms,1",
        "fall,height_at_0.5_s,8.8,0.1,m,2,,1",
        "drop,height,9.5,0.1,m,2,,1",
        "drop,height,9.5,0.1,m,2,300 ms,2",
    ]
    study = read_study(write(end=FALL, measurements=SERIES + "\n".join(rows)))
    table = read_measurements(study)
    first = ["height_at_0.25_s", "height_at_0.25_s", "height_at_1_s", "height_at_0.5_s"]
    assert list(table["observable"]) == [*first, "height", "height"]
    assert list(table["time"]) == ["0.25", "0.25", "1000 ms", "", "", "300 ms"]
    assert table["value"][0] == pytest.approx(9.8)
    run = pd.DataFrame(
        {"experiment": ["fall"], "height_at_0.25_s": [9.693], "height_at_0.5_s": [8.77], "height_at_1_s": [5.1]}
    )
    compared = summarise(study, run, table)
    assert list(compared["measured"]) == pytest.approx([9.8, 9.7, 8.8, 5.0])


@pytest.mark.parametrize(
    ("row", "part"),
    [
        ("fall,height,5,1,m,1,2.0,", "height is given at time '2.0'; free_fall measures it at 0.25 s, 0.5 s, 1 s. Add"),
        ("fall,height,5,1,m,1,,", "height is given without its time; free_fall measures it at 0.25 s, 0.5 s, 1 s. Say"),
        ("fall,height,5,1,m,1,1 kg,", "time is '1 kg': this is in kilogram; it needs a unit that converts to s"),
        ("fall,heigt,5,1,m,1,1.0,", "Unknown observable of fall (free_fall) 'heigt'"),
        ("drop,height,5,1,m,1,0.4,", "height is given at time '0.4'; free_fall measures it at 0.3 s."),
    ],
)
def test_a_height_at_no_time_of_the_test_is_refused(write, row, part):
    study = read_study(write(end=FALL, measurements=SERIES + row))
    with pytest.raises(FileError) as error:
        read_measurements(study)
    (problem,) = error.value.problems
    assert problem.startswith(f"line 2: {part}")


ROW = "narrow,angle,12.5,0.5,deg,4,by hand"
CASES = {
    "unknown experiment": (
        "narow,angle,1,1,deg,1,",
        ["line 2: Unknown experiment", "'narow'", "Did you mean 'narrow'?"],
    ),
    "observable that the experiment doesn't make": (
        "narrow,mass,1,1,deg,1,",
        ["line 2: Unknown observable of narrow (quick) 'mass'", "Allowed: angle, flow"],
    ),
    "u zero": ("narrow,angle,1,0,deg,1,", ["line 2: u is 0", "above 0"]),
    "u negative": ("narrow,angle,1,-0.5,deg,1,", ["line 2: u is -0.5"]),
    "u missing": ("narrow,angle,1,,deg,1,", ["line 2: u is ''", "finite number"]),
    "unit of another dimension": ("narrow,angle,1,1,kg,1,", ["line 2: unit of angle", "'1 kg'", "converts to deg"]),
    "no unit known": ("narrow,angle,1,1,blorp,1,", ["line 2: unit of angle", "blorp"]),
    "pure number for a flow": (
        "narrow,flow,1,1,1,1,again",
        ["line 2: unit is '1'", "flow is measured in g/s"],
    ),
    "pure number for an angle": ("narrow,angle,1,1,1,1,", ["line 2: unit is '1'", "angle is measured in deg"]),
    "unit missing": ("narrow,angle,1,1,,1,", ["line 2: unit is empty", "measured in deg"]),
    "n zero": ("narrow,angle,1,1,deg,0,", ["line 2: n is 0", "from 1"]),
    "n no whole number": ("narrow,angle,1,1,deg,1.5,", ["line 2: n is 1.5", "whole number"]),
    "value no number": ("narrow,angle,high,1,deg,1,", ["line 2: value is 'high'", "finite number"]),
    "value infinite": ("narrow,angle,inf,1,deg,1,", ["line 2: value is 'inf'", "finite number"]),
    "row twice": (f"{ROW}\nnarrow,angle,1,1,deg,1,by hand", ["line 3: narrow, angle stands in line 2 already"]),
    "too long a row": (
        "narrow,angle,12,5,0.5,deg,4,by hand",
        ["line 2: it has 8 cells, but line 1 names 7 columns"],
    ),
    "a comma in a remark": (f"{ROW}, twice", ["line 2: it has 8 cells"]),
    "too short a row": ("narrow,angle,1", ["line 2: u is ''", "line 2: n is ''", "line 2: unit is empty"]),
}


@pytest.mark.parametrize("case", CASES)
def test_a_problem_is_told_with_its_line(write, case):
    row, parts = CASES[case]
    study = read_study(write(measurements=MEASUREMENTS.replace(ROW, row)))
    with pytest.raises(FileError) as error:
        read_measurements(study)
    text = "\n".join(error.value.problems)
    for part in parts:
        assert part in text
    assert len(error.value.problems) == len([part for part in parts if part.startswith("line")])


def test_all_problems_at_once(write):
    rows = [row for row, _ in list(CASES.values())[:5]]
    study = read_study(write(measurements=MEASUREMENTS.splitlines()[0] + "\n" + "\n".join(rows)))
    with pytest.raises(FileError) as error:
        read_measurements(study)
    lines = {problem.split(":")[0] for problem in error.value.problems}
    assert lines == {f"line {k}" for k in range(2, 7)}


@pytest.mark.parametrize("column", ["experiment", "observable", "value", "u", "unit", "n"])
def test_a_missing_column(write, column):
    header = MEASUREMENTS.splitlines()[0]
    renamed = ",".join(f"{name}_" if name == column else name for name in header.split(","))
    study = read_study(write(measurements=MEASUREMENTS.replace(header, renamed)))
    with pytest.raises(FileError, match=f"column {column} is missing; the table needs the columns"):
        read_measurements(study)


HEADER, FIRST = MEASUREMENTS.splitlines()[:2]
HEADERS = {
    "a column twice": (HEADER.replace("remark", "u"), ["column u stands 2 times in line 1; keep one."]),
    "a column without name": (f"{HEADER.replace('remark', '')},note", ["line 1: column 7 has no name"]),
    "semicolons": (HEADER.replace(",", ";"), ["separator: the cells are separated by ';'; separate them by ','"]),
    "tabs": (HEADER.replace(",", "\t"), ["separator: the cells are separated by a tab;"]),
}


@pytest.mark.parametrize("case", HEADERS)
def test_what_is_wrong_with_the_header(write, case):
    header, parts = HEADERS[case]
    study = read_study(write(measurements=f"{header}\n{FIRST}\n"))
    with pytest.raises(FileError) as error:
        read_measurements(study)
    for problem, part in zip(error.value.problems, parts, strict=True):
        assert problem.startswith(part)


def test_commas_at_the_ends_of_lines_do_no_harm(write):
    text = "\n".join(f"{line},," for line in MEASUREMENTS.splitlines())
    table = read_measurements(read_study(write(measurements=text + "\n,,,\n")))
    assert len(table) == 3
    assert list(table["remark"]) == ["by hand", "", ""]


def test_a_line_break_in_a_cell_is_counted(write):
    text = MEASUREMENTS.replace("by hand", '"by\nhand"').replace("wide", "wid")
    with pytest.raises(FileError, match="line 5: Unknown experiment"):
        read_measurements(read_study(write(measurements=text)))


def test_no_file_no_rows_and_no_table(write):
    study = read_study(write())
    with pytest.raises(InputError, match=r"There is no .*measurements.csv.*experiment,observable,value,u,unit,n"):
        read_measurements(study)
    for text, part in (
        ("experiment,observable,value,u,unit,n\n", "holds no measurement"),
        ("", "no table"),
        ('a,"b\nc', "no table"),
    ):
        write(measurements=text)
        with pytest.raises(InputError, match=part):
            read_measurements(study)
    (study.path / "measurements.csv").write_bytes(b"experiment\xff\n1\n")
    with pytest.raises(InputError, match="UTF-8"):
        read_measurements(study)
