"""``velotyre front-frame`` as a user runs it: what it prints, or why it refuses."""

import pytest

from studies.cli import main


def run(capsys, *arguments):
    """Text that the command prints."""
    main(["front-frame", *map(str, arguments)])
    return capsys.readouterr().out


def refuse(capsys, *arguments):
    """Error that the command prints."""
    with pytest.raises(SystemExit):
        main(["front-frame", *map(str, arguments)])
    return capsys.readouterr().err
