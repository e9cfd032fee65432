"""Output in an encoding without Greek letters, as that of a file on Windows, holds ASCII in their place."""

import os
import subprocess
import sys

import pytest

from studies.reporting import spell_out


@pytest.mark.parametrize(("text", "ascii_text"), [
    ("reduced χ² 1.3", "reduced chi2 1.3"), ("C∝, 5 µm ± 2 × 3", "C?, 5 mum +- 2 x 3"), ("a → b …", "a -> b ..."),
    ("Dell’Orto, Müller", "Dell'Orto, Muller"),
])  # fmt: skip
def test_letters_are_spelled_out(text, ascii_text):
    assert spell_out(text) == ascii_text


@pytest.mark.parametrize("encoding", ["cp1252", "iso8859-9"])
def test_a_table_with_greek_letters_is_written_in_every_encoding(encoding):
    environment = os.environ | {"PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}
    command = [sys.executable, "-c", "from studies.cli import main; main(['tyres'])"]
    done = subprocess.run(command, env=environment, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "alpha" in done.stdout.decode(encoding)


def test_a_refusal_with_a_letter_that_is_lacking_is_one_line():
    environment = os.environ | {"PYTHONIOENCODING": "iso8859-9", "PYTHONUTF8": "0"}
    command = [sys.executable, "-c", "from studies.cli import main; main(['critical', 'χ'])"]
    done = subprocess.run(command, env=environment, capture_output=True, check=False)
    assert done.returncode == 2
    assert done.stderr.decode("iso8859-9").startswith("velotyre: unknown bicycle or model 'chi'")
    assert done.stderr.count(b"\n") == 1
