"""Valid inputs of every reader, shipped, documented or written as other programs write them, to be damaged."""

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from tyre.base.errors import InputError
from tyre.base.paths import data_root

BLOCK = re.compile(r"^```\{code-block\} \w+\n:caption: (\S+?)(?:,.*)?\n(.*?)^```", flags=re.MULTILINE | re.DOTALL)


PAGES = ("measurement_files", "bicycles", "tyres", "sweeps", "simulate_identify_diagnose", "stability_charts")


@dataclass(frozen=True)
class Example:
    """A valid input.

    Attributes
    ----------
    name : str
    files : dict of str to bytes
        Name -> content; written into a folder of its own.
    main : str
        What the reader is given.
    victims : tuple of str
        Files that are damaged, one at a time.
    """

    name: str
    files: dict[str, bytes]
    main: str
    victims: tuple[str, ...]


def one(name: str, content: bytes | str, file: str | None = None) -> Example:
    """An example of a single file (``name`` or ``file``) with some ``content``."""
    file = file or Path(name).name
    return Example(name, {file: content if isinstance(content, bytes) else content.encode()}, file, (file,))


def shipped(folder: str, *endings: str) -> list[Example]:
    """Every packaged file of a ``folder`` of the data with one of some ``endings``, alone."""
    found = [f for f in data_root().joinpath(folder).iterdir() if f.name.endswith(endings)]
    return [one(f"{folder}/{f.name}", f.read_bytes(), f.name) for f in sorted(found, key=lambda f: f.name)]


@cache
def documented() -> dict[str, dict[str, bytes]]:
    """Files that the pages of the documentation show, by page (the file's folder where it has one) and name.

    Raises
    ------
    InputError
        There is no documentation: not a checkout.
    """
    docs = Path(__file__).parents[2] / "docs"
    if not docs.is_dir():
        raise InputError(f"{docs}: the documented examples are not here; run this in a checkout of the repository")
    found: dict[str, dict[str, bytes]] = {}
    for page in PAGES:
        for caption, text in BLOCK.findall((docs / f"{page}.md").read_text(encoding="utf-8")):
            folder, _, name = caption.rpartition("/")
            found.setdefault(f"{page}/{folder}".rstrip("/"), {})[name] = text.encode()
    return found


def measurements() -> list[Example]:
    """Documented and packaged measurement files with their tables."""
    found = []
    for name, files in documented().items():
        if name.startswith("measurement_files/"):
            for main in [file for file in files if file in ("MEASUREMENT.toml", "with_modes.toml")]:
                kept = {file: text for file, text in files.items() if file == main or not file.endswith("S.toml")}
                found.append(Example(f"{name}/{main}", kept, main, tuple(kept)))
    rig = documented()["measurement_files/rig"]
    gappy = rig | {"pull.csv": gaps(rig["pull.csv"])}
    found.append(Example("rig with missing samples", gappy, "MEASUREMENT.toml", ("MEASUREMENT.toml",)))
    folder = data_root() / "measured"
    for name, table in (("kooijman2008", "weave"), ("balance_assist", "weave"), ("steer_by_wire", "weave"),
                        ("davis", "canonical_coefficients")):  # fmt: skip
        files = {file: folder.joinpath(file).read_bytes() for file in (f"{name}.toml", f"{name}_{table}.csv")}
        found.append(Example(f"measured/{name}", files, f"{name}.toml", tuple(files)))
    tables = {name: data_root().joinpath("tyres", name).read_bytes()
              for name in ("Tyre1_flat.csv", "Tyre1_flat.toml", "Tyre1_drum.csv", "Tyre1_drum.toml")}  # fmt: skip
    text = data_root().joinpath("measured", "tyre1_drum.toml").read_bytes().replace(b"../tyres/", b"")
    found.append(
        Example("measured/tyre1_drum", tables | {"tyre1_drum.toml": text}, "tyre1_drum.toml", ("tyre1_drum.toml",))
    )
    return found


def gaps(table: bytes) -> bytes:
    """The CSV ``table`` whose cells are empty in turn, one in every fourth row."""
    rows = [line.split(b",") for line in table.strip().split(b"\n")]
    for place, row in enumerate(rows[2::4]):
        row[place % len(row)] = b""
    return b"\n".join(b",".join(row) for row in rows) + b"\n"


def models() -> list[Example]:
    """Model files with numbers, with a table, with a .tir file, with a bicycle in a file, with a covariance."""
    tyres = documented()["tyres"]
    lone = {
        "numbers": 'bicycle = "benchmark"\n[effects.relaxation_length]\ncornering_stiffness = 6000.0\n'
        "relaxation_length = 0.1\n[effects.steer_damper]\ndamping = 1.0\n",
        "wheels": 'bicycle = "pista_rider"\ndescription = "x"\n[effects.relaxation_length]\ntyre = "Tyre1"\n'
        'surface = "flat"\n'
        "pressure_bar = {rear = 7.5, front = 5.5}\nextrapolate = false\n",
        "added": 'bicycle = "benchmark"\nallow_unusual = false\n[effects.luggage]\nmass = 10.0\n'
        "[effects.steer_spring]\nstiffness = 2.0\n",
        "covariance": 'bicycle = "benchmark"\n[effects.steer_damper]\ndamping = 1.0\n[covariance]\n'
        'parameters = ["mB", "steer_damper.damping"]\nmatrix = [[1.0, 0.1], [0.1, 0.2]]\n',
    }  # fmt: skip
    found = [one(f"model {name}", text, "model.toml") for name, text in lone.items()]
    table = b"[bicycle]\n" + data_root().joinpath("bicycles", "benchmark.toml").read_bytes().split(b"[values]")[1]
    found.append(one("model with its own bicycle", table, "model.toml"))
    tir = {"model.toml": tyres["model.toml"], "example.tir": tyres["example.tir"]}
    found.append(Example("model with .tir", tir, "model.toml", tuple(tir)))
    own = {"model.toml": b'bicycle = "mine.toml"\n[effects.side_slip]\ncornering_stiffness = 6000.0\n',
           "mine.toml": documented()["bicycles"]["mine.toml"]}  # fmt: skip
    found.append(Example("model and bicycle", own, "model.toml", tuple(own)))
    return found


def tyre_tables() -> list[Example]:
    """A packaged table with its sidecar, and one of another laboratory."""
    found = []
    for name in ("Tyre1_flat", "Tyre1_drum", "Tyre2_flat"):
        files = {f"{name}{e}": data_root().joinpath("tyres", f"{name}{e}").read_bytes() for e in (".csv", ".toml")}
        found.append(Example(f"tyres/{name}", files, f"{name}.csv", tuple(files)))
    return [*found, one("tyres of others", documented()["tyres"]["others.csv"], "others.csv")]


def tyre_property_files() -> list[Example]:
    """The documented .tir file, and one that lacks what may be lacking, which then is NaN."""
    text = documented()["tyres"]["example.tir"]
    return [
        one("example.tir", text),
        one("without.tir", re.sub(rb"(LATERAL_STIFFNESS|PKY6|QDZ1|QDZ8|QSX2) = .*", b"", text)),
    ]


def coefficients() -> list[Example]:
    """Pacejka-89 coefficients as TOML and as lists."""
    tyres = documented()["tyres"]
    numbers = "[1.3, 0, 1000, 110, 0.7, 0, 0, -1, 0.05, 0, 0, 2, 0, 0]"
    return [
        one("pacejka89", tyres["example.toml"], "example.toml"),
        one("pacejka89 bare", tyres["example.toml"].replace(b"lateral_stiffness_N_per_mm = 55", b""), "example.toml"),
        *shipped("tyres", "28x1.75.toml"),
        one("pacejka89 text", tyres["example_p400.txt"], "example_p400.txt"),
        one("pacejka89 json", f'{{"side_force": {numbers}, "pressure_bar": 4, "load_max_N": 900}}', "list.json"),
        one("pacejka89 yaml", f"OptParameterMF_Fy: {numbers}\npressure_kPa: 400\nslip_unit: deg\n", "list.yaml"),
    ]  # fmt: skip


def sweeps() -> list[Example]:
    """Documented sweeps with their model."""
    files, model = documented()["sweeps"], "model.toml"
    return [
        Example(f"sweeps/{main}", {name: files[name] for name in (model, main)}, main, (main, main, model))
        for main in ("grid.toml", "sample.toml", "covariance.toml")
    ]  # fmt: skip
