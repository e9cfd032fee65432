"""Adds ``--golden-update``, which writes the expected numbers anew."""

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--golden-update", action="store_true", help="Write the expected numbers of tests/golden anew.")
