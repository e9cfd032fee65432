"""Reading TOML files: what is refused, and in which words."""

import os
from pathlib import Path

import pytest

from tyre.base.errors import InputError
from tyre.base.toml_file import read_toml


def test_a_byte_order_mark_and_windows_lines_are_read(tmp_path):
    path = tmp_path / "a.toml"
    path.write_bytes(b"\xef\xbb\xbfa = 1\r\nb = 2\r\n")
    assert read_toml(path, "model file") == {"a": 1, "b": 2}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, r"a\.toml: no such model file"),
        (b"a = ", r"a\.toml: not a TOML file: Invalid value \(at end of document\)"),
        (b"a = 1\na = 2", r"a\.toml: not a TOML file: Cannot overwrite a value"),
        (b'a = "\xff"', r"a\.toml: not a TOML file: 'utf-8' codec"),
        (b"a = " + b"9" * 5000, r"a\.toml: not a TOML file: Exceeds the limit .* value has 5000 digits"),
        (b"a = " + b"[" * 5000, r"a\.toml: not a TOML file: maximum recursion depth"),
    ],
)
def test_what_is_no_toml_file(tmp_path, content, words):
    path = tmp_path / "a.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=words):
        read_toml(path, "model file")


def test_a_folder_is_no_file(tmp_path):
    with pytest.raises(InputError, match=r"cannot be read as a model file \(Is a directory\)"):
        read_toml(tmp_path, "model file")


def test_a_pipe_is_refused_before_it_is_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    with pytest.raises(InputError, match=r"pipe.toml: is a pipe or a device; write what comes out of it to a file"):
        read_toml(tmp_path / "pipe.toml", "model file")
    with pytest.raises(InputError, match=r"/dev/zero: is a pipe or a device"):
        read_toml(Path("/dev/zero"), "model file")


def test_the_message_may_begin_with_the_key_that_names_the_file(tmp_path):
    with pytest.raises(InputError, match=r"^model = 'b\.toml': no such model file"):
        read_toml(tmp_path / "b.toml", "model file", where="model = 'b.toml'")
