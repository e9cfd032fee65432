"""How to get what is missing: from where this velotyre came."""

import json

import pytest

from tyre.base import optional

FOLDER, WHEEL = "file:///home/me/velo%20tyre", "file:///home/me/velotyre-1.0.0-py3-none-any.whl"


class Installed:
    def __init__(self, origin):
        self.origin = origin

    def read_text(self, name):
        assert name == "direct_url.json"
        return json.dumps(self.origin) if self.origin else None


@pytest.mark.parametrize(
    ("origins", "command"),
    [
        ([], 'pip install "velotyre[rider]"'),
        ([None], 'pip install "velotyre[rider]"'),
        ([{"url": FOLDER, "dir_info": {}}], 'pip install "/home/me/velo tyre[rider]"'),
        ([None, {"url": FOLDER, "dir_info": {"editable": True}}], 'pip install -e "/home/me/velo tyre[rider]"'),
        ([{"url": WHEEL, "archive_info": {}}], f'pip install "velotyre[rider] @ {WHEEL}"'),
        (
            [{"url": "https://example.org/velotyre", "vcs_info": {"vcs": "git", "commit_id": "0"}}],
            'pip install "velotyre[rider] @ git+https://example.org/velotyre"',
        ),
    ],
)
def test_an_extra_comes_from_where_velotyre_came(monkeypatch, origins, command):
    monkeypatch.setattr(optional, "distributions", lambda name: map(Installed, origins))
    assert optional.install_command("rider") == command
    with pytest.raises(ImportError, match="^no_such_package is not installed; install it with: ") as missing:
        optional.optional_module("no_such_package", extra="rider")
    assert str(missing.value).endswith(command)
