"""What may be loaded, and under which name: nothing leads out of the private folder."""

import io
import zipfile
from pathlib import Path

import pytest

from studies.explorer.recording import desk as desks
from studies.explorer.recording.desk import Desk, Desks
from studies.explorer.recording.names import file_name
from tyre.base.errors import InputError


@pytest.fixture
def desk():
    made = Desk()
    yield made
    made.close()


def put(desk, name, content):
    desk.load(name, io.BytesIO(content), len(content))


def packed(files):
    found = io.BytesIO()
    with zipfile.ZipFile(found, "w", zipfile.ZIP_DEFLATED) as opened:
        for name, content in files.items():
            opened.writestr(name, content)
    return found.getvalue()


def names(desk):
    return [one["name"] for one in desk.files()]


def test_files_that_a_command_writes_meanwhile_are_listed_when_complete(desk, monkeypatch):
    put(desk, "gone.csv", b"t,x\n")
    put(desk, "log.csv", b"t,x\n")
    (desk.folder / ".model.part30609.toml").write_text("speed = ")
    real = Path.lstat

    def vanishes(path):
        if path.name == "gone.csv":
            path.unlink()  # between the listing and the question for its size
        return real(path)

    monkeypatch.setattr(Path, "lstat", vanishes)
    assert names(desk) == ["log.csv"]


def test_files_keep_their_names_and_are_gone_at_the_end(desk):
    put(desk, "run 1 (a)@Ü.csv", b"t,x\n1,2\n")
    put(desk, "runs/b.csv", b"t,x\n")
    assert desk.files() == [{"name": "run 1 (a)@Ü.csv", "bytes": 8}, {"name": "runs/b.csv", "bytes": 4}]
    assert desk.file("runs/b.csv").read_bytes() == b"t,x\n"
    assert desk.file("runs/../runs/b.csv") is None
    desk.remove("runs/b.csv")
    desk.remove("/etc/passwd")
    assert names(desk) == ["run 1 (a)@Ü.csv"]
    desk.close()
    assert not desk.folder.exists()


@pytest.mark.parametrize(
    "name",
    [
        "/etc/passwd", "../x.csv", "a/../../x.csv", "a//b.csv", ".hidden", "a/.b", "-out", "~x", "a\\b.csv", "c:x.csv",
        "", " ", "a\nb.csv", "x" * 101, "a/b/c/d/e.csv", "look/x.csv", "fit", "diagnosis/report.html",
        "tyre_fit/x.csv", "as_loaded/x.csv", "a?b", 'a".csv',
        "<b>.csv",
    ],
)  # fmt: skip
def test_a_name_that_leads_elsewhere_is_refused(desk, name):
    with pytest.raises(InputError, match="cannot be loaded under this name: letters, digits, blanks"):
        put(desk, name, b"x")
    assert names(desk) == []


def test_a_name_says_where_it_is_kept():
    assert file_name("a/b c.csv") == "a/b c.csv"


def test_sizes_are_bounded(desk, monkeypatch):
    monkeypatch.setattr(desks, "LARGEST_FILE", 10)
    monkeypatch.setattr(desks, "LARGEST_ALL", 15)
    monkeypatch.setattr(desks, "MOST_FILES", 2)
    with pytest.raises(
        InputError, match=r"a\.csv: 11 bytes are more than the 10 that a file may have here; use the comm"
    ):
        put(desk, "a.csv", b"x" * 11)
    put(desk, "a.csv", b"x" * 9)
    with pytest.raises(InputError, match=r"b\.csv: all files together are more than 15 bytes; remove some, or use"):
        put(desk, "b.csv", b"x" * 9)
    put(desk, "a.csv", b"y" * 8)  # in place of the first
    put(desk, "b.csv", b"x")
    with pytest.raises(InputError, match=r"c\.csv: more than 2 files; remove some"):
        put(desk, "c.csv", b"x")


def test_a_body_that_ends_early_is_not_kept(desk):
    with pytest.raises(InputError, match=r"a\.csv: the browser did not send it whole"):
        desk.load("a.csv", io.BytesIO(b"xx"), 5)
    assert names(desk) == []


def test_a_zip_keeps_its_folders(desk):
    put(desk, "all.zip", packed({"m.toml": "kind = 1", "runs/a.csv": "t", "__MACOSX/m": "x", "runs/.DS_Store": "x"}))
    assert names(desk) == ["m.toml", "runs/a.csv"]
    with pytest.raises(InputError, match="runs is a folder here; call the file otherwise"):
        put(desk, "runs", b"x")


@pytest.mark.parametrize("inside", ["../x.csv", "/etc/x.csv", "look/x.csv", "a/../../b.csv"])
def test_a_zip_stays_inside(desk, inside):
    with pytest.raises(InputError, match="cannot be loaded under this name"):
        put(desk, "all.zip", packed({"a.csv": "t", inside: "x"}))
    assert names(desk) == []


def test_a_zip_that_is_none_or_swells_is_refused(desk, monkeypatch):
    assert (desks.LARGEST_FILE, desks.LARGEST_ALL) == (32_000_000, 100_000_000)
    monkeypatch.setattr(desks, "LARGEST_FILE", 32_000)
    monkeypatch.setattr(desks, "LARGEST_ALL", 100_000)
    with pytest.raises(InputError, match=r"all\.zip: this zip cannot be opened \(File is not a zip file\)"):
        put(desk, "all.zip", b"PK nonsense")
    with pytest.raises(InputError, match=r"all\.zip, big\.csv: 32001 bytes are more than the 32000 "):
        put(desk, "all.zip", packed({"big.csv": b"0" * 32_001}))
    swollen = packed({f"{k}.csv": b"0" * 30_000 for k in range(4)})
    with pytest.raises(InputError, match=r"all\.zip: its files together are more than 100000 bytes"):
        put(desk, "all.zip", swollen)
    assert names(desk) == []


def test_a_file_that_names_one_outside_is_refused(desk, tmp_path):
    secret = tmp_path / "secret.csv"
    secret.write_text("speed_m_s\n1\n")
    climbing = f"{'../' * 12}{str(secret).lstrip('/')}"
    for text in (
        f"bicycle = '{secret}'", f"bicycle = '{secret}#one'", f"[modal]\ntable = '{climbing}'",
        f"[histories]\nfolder = '{tmp_path}'", "[histories]\nfile = '/etc/*.csv'", "[histories]\nfile = '../*.csv'",
        "[[part]]\n[part.modal]\ntable = ['/etc/passwd']", "recording = '..'", "[reading]\ndbc = ['~']",
    ):  # fmt: skip
        with pytest.raises(InputError, match=r"m\.toml: .* is a file outside what was loaded; load it too and name it"):
            put(desk, "m.toml", text.encode())
        with pytest.raises(InputError, match=r"m\.toml: .* is a file outside what was loaded"):
            put(desk, "all.zip", packed({"m.toml": text}))
        assert names(desk) == []
    put(desk, "weave.csv", b"t")
    put(
        desk,
        "m.toml",
        b"description = '/etc/passwd'\n[modal]\ntable = 'weave.csv'\n[channels]\nx = {column = '/run 1/gyro'}",
    )
    put(desk, "bad.toml", b"this is no TOML = ")
    assert names(desk) == ["bad.toml", "m.toml", "weave.csv"]


def test_an_hdf5_file_that_reads_another_one_is_refused(desk, tmp_path):
    h5py = pytest.importorskip("h5py")
    secret = tmp_path / "secret.bin"
    secret.write_bytes(b"\0" * 64)

    def content(fill):
        path = tmp_path / "made.h5"
        with h5py.File(path, "w") as file:
            fill(file)
        return path.read_bytes()

    def linked(file):
        file.create_group("a")["b"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "/x")

    def raw(file):
        file.create_dataset("x", (8,), "f8", external=[(str(secret), 0, 64)])

    def virtual(file):
        layout = h5py.VirtualLayout(shape=(8,), dtype="f8")
        layout[:] = h5py.VirtualSource(str(tmp_path / "other.h5"), "x", shape=(8,))
        file.create_virtual_dataset("x", layout)

    for fill in (linked, raw, virtual):
        with pytest.raises(InputError, match=r"run\.h5: some of its data are in other files \(HDF5 links\)"):
            put(desk, "run.h5", content(fill))
    put(desk, "run.h5", content(lambda file: file.create_dataset("a/x", data=[1.0, 2.0])))
    put(desk, "cut.h5", content(lambda file: file.create_dataset("a/x", data=[1.0, 2.0]))[:300])
    assert names(desk) == ["cut.h5", "run.h5"]


def test_the_oldest_folder_makes_room():
    open_ = Desks()
    first, second, *_ = made = [open_.open() for _ in range(desks.MOST_DESKS)]
    assert open_.find(second.token) is second  # used: it is no longer the oldest but one
    fifth = open_.open(spare=first.token)
    assert [open_.find(one.token) is one for one in made] == [True, True, False, True]
    assert open_.find("nonsense") is None
    open_.close()
    assert not any(one.folder.exists() for one in (*made, fifth))
