"""Files are whole or as they were."""

from __future__ import annotations

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
