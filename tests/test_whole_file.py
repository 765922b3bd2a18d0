"""Files are whole or as they were."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from taichidem.whole_file import save_figure, whole_file, write_whole


def test_a_text_takes_the_place_of_the_one_before(tmp_path):
    for text in ("one\n", "zwölf\n"):
        write_whole(tmp_path / "a.json", text)
        assert (tmp_path / "a.json").read_bytes().decode() == text
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


def test_an_error_leaves_the_file_as_it_was_and_nothing_beside_it(tmp_path):
    write_whole(tmp_path / "a.json", "whole")

    def broken(path, stop):
        with whole_file(path) as fresh:
            fresh.write_text("ha")
            assert path.read_text() == "whole" if path.exists() else True
            raise stop

    for name in ("a.json", "b.json"):
        with pytest.raises(KeyboardInterrupt):
            broken(tmp_path / name, KeyboardInterrupt)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.json": "whole"}


def test_a_picture_keeps_its_format(tmp_path):
    from matplotlib.figure import Figure

    save_figure(Figure(figsize=(1, 1)), tmp_path / "a.png", dpi=20)
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


def test_a_folder_that_is_not_there(tmp_path):
    with pytest.raises(FileNotFoundError):
        write_whole(tmp_path / "nowhere" / "a.json", "")


WRITER = """
import sys, time
from taichidem.whole_file import whole_file
with whole_file(sys.argv[1]) as fresh:
    fresh.write_text("half")
    print(fresh.name, flush=True)
    time.sleep(600)
"""


def writer(path):
    """Start a process that is in the middle of a write, and return it with the name of its unfinished file."""
    process = subprocess.Popen([sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, text=True, cwd=ROOT)
    return process, process.stdout.readline().strip()


ROOT = Path(__file__).parents[1]


def names(folder):
    return {path.name for path in folder.iterdir()}


@pytest.mark.skipif(os.name != "posix", reason="elsewhere nobody asks whether a process lives")
def test_what_a_killed_writer_left_is_deleted_and_a_living_one_is_left_alone(tmp_path):
    path = tmp_path / "a.v1.json"
    killed, left = writer(path)
    living, held = writer(path)
    other, elsewhere = writer(tmp_path / "a.json")
    try:
        for process in (killed, other):
            process.kill()
            process.communicate()
        foreign = tmp_path / left.replace(
            left.split(".")[3].partition("-")[0], "another1"
        )  # of a machine of that number
        foreign.write_text("half")
        assert names(tmp_path) == {left, held, elsewhere, foreign.name}
        write_whole(path, "whole")
        assert names(tmp_path) == {"a.v1.json", held, elsewhere, foreign.name}
        assert path.read_text() == "whole"
    finally:
        living.kill()
        living.communicate()


def test_what_is_no_file_is_written_to_and_a_link_stays_one(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    reading = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    write_whole(tmp_path / "pipe", "through")
    assert os.read(reading, 99) == b"through"
    os.close(reading)
    (tmp_path / "link").symlink_to("real")
    write_whole(tmp_path / "link", "whole")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "whole"
    assert names(tmp_path) == {"pipe", "link", "real"}


def test_a_folder_is_not_replaced(tmp_path):
    (tmp_path / "a").mkdir()
    with pytest.raises(OSError, match="directory"):
        write_whole(tmp_path / "a", "")
    assert names(tmp_path) == {"a"}
