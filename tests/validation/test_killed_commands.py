"""A command that is killed while it writes leaves whole files or none under their final names, and runs again."""

import json
import subprocess
import sys

import pytest

PROGRAM = """
import os, signal, sys
from studies.cli import main

COMMAND = "simulate benchmark --speed 5 --initial lean=0.02 --out out".split()

def ended(number, how, seconds):
    # A copy of this process, in which all is imported: a signal ends it so many seconds after it opens this file.
    def count(event, arguments):
        nonlocal number
        if event == "open" and ".part" in str(arguments[0]) and "w" in str(arguments[1]):
            number -= 1
            if not number:
                signal.signal(signal.SIGALRM, how)
                signal.setitimer(signal.ITIMER_REAL, seconds)
    child = os.fork()
    if not child:
        sys.addaudithook(count)
        main(COMMAND)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])

main(COMMAND)
print([ended(number, signal.SIG_DFL, 2e-4 if number < 3 else 2e-2) for number in (1, 2, 3, 4)])
print(ended(3, signal.default_int_handler, 2e-2))  # as Ctrl+C
"""
ENDS = {".svg": b"</svg>\n", ".png": b"IEND\xaeB`\x82", ".csv": b"\n", ".json": b"}\n"}


@pytest.mark.skipif(sys.platform == "win32", reason="kills by signal")
def test_a_killed_command_leaves_no_half_file(tmp_path):
    done = subprocess.run([sys.executable, "-c", PROGRAM], cwd=tmp_path, capture_output=True, text=True)
    assert "Traceback" not in done.stderr
    assert done.stdout.splitlines()[-2:] == ["[-14, -14, -14, -14]", "130"], done.stdout  # by SIGALRM; interrupted
    files = [file for file in (tmp_path / "out").iterdir() if not file.name.startswith(".")]
    assert sorted(file.suffix for file in files) == sorted(ENDS)
    for file in files:
        assert file.read_bytes().endswith(ENDS[file.suffix]), file.name
    json.loads((tmp_path / "out" / "simulate.manifest.json").read_text())
