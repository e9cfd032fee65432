"""With which version something was made."""

from importlib.metadata import version

from studies.reporting.made_by import made_by, version_of


def test_the_version_is_the_installed_one():
    assert made_by() == f"\n\nMade by velotyre {version('velotyre')}.\n"
    assert version_of("numpy") == version("numpy")


def test_what_is_not_installed_is_said():
    assert version_of("a-library-that-nobody-has-installed") == "not installed"
