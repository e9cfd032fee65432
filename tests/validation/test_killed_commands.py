"""A command that is killed leaves whole files or none under their final names, and runs again."""

import json
import random
import signal
import subprocess
import sys
import time

import pytest

COMMAND = "from studies.cli import main; main('simulate benchmark --speed 5 --initial lean=0.02 --out out'.split())"
ENDS = {".svg": b"</svg>\n", ".png": b"IEND\xaeB`\x82", ".csv": b"\n"}


def started(folder):
    return subprocess.Popen([sys.executable, "-c", COMMAND], cwd=folder, stdout=subprocess.DEVNULL,
                            stderr=subprocess.PIPE, text=True, start_new_session=True)  # fmt: skip


@pytest.mark.skipif(sys.platform == "win32", reason="kills by signal")
def test_a_killed_command_leaves_no_half_file(tmp_path):
    began = time.monotonic()
    with started(tmp_path) as process:
        assert process.wait() == 0
    took, rng = time.monotonic() - began, random.Random(2026)
    whole = {file.name for file in (tmp_path / "out").iterdir()}
    for _ in range(2):
        with started(tmp_path) as process:
            time.sleep(rng.uniform(0.5, 0.95) * took)
            process.kill()
        for file in (tmp_path / "out").iterdir():
            if file.name in whole and file.suffix in ENDS:
                assert file.read_bytes().endswith(ENDS[file.suffix]), file.name
            elif file.name in whole and file.suffix == ".json":
                json.loads(file.read_text())
    with started(tmp_path) as process:
        time.sleep(0.6 * took)
        process.send_signal(signal.SIGINT)
        said = process.stderr.read()
    assert "Traceback" not in said
