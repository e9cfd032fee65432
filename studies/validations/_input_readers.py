"""Every reader as its command calls it, with one cheap computation of what it read; and what in it is not finite."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from studies.validations import _input_examples as examples
from studies.validations import _input_reads as reads
from studies.validations import _input_recordings as recordings
from studies.validations._input_examples import Example
from studies.validations._input_reads import Read


@dataclass(frozen=True)
class Reader:
    """A reader, what it is given, and its share of all inputs."""

    name: str
    share: float
    read: Read
    examples: Callable[[Path], Sequence[Example]]


def _addresses(_: Path) -> list[Example]:
    own = "&".join(f"bicycle.{key}={value}" for key, value in _benchmark().items())
    texts = (
        "", "bicycle=pista&rider=charlie&posture=drops", "bicycle=benchmark&effects.steer_damper.damping=1&at=6",
        "bicycle=benchmark&effects.relaxation_length.tyre=Tyre1&effects.relaxation_length.pressure_bar=5&load.rear=500",
        f"{own}&name=mine&mode=weave&pin=bicycle%3Dpista", "bicycle=benchmark&effects.camber_thrust=on",
    )  # fmt: skip
    return [examples.one(f"address {k}", text, "an.address") for k, text in enumerate(texts)]


def _benchmark() -> Mapping[str, float]:
    from bicycle.files.bicycle_file import load_bicycle

    return load_bicycle("benchmark").values


def _starts(kind: str) -> list[Example]:
    from studies.missing_effect.plan.example import EXAMPLE as COSTS
    from studies.synthetic_sensors.example import EXAMPLE as SENSORS

    return [examples.one(kind, {"costs": COSTS, "sensors": SENSORS}[kind].format(file="x.toml"), f"{kind}.toml")]


def _bicycle_files(_: Path) -> list[Example]:
    from bicycle.files.bicycle_file import load_bicycle, to_text, to_yaml

    pista = load_bicycle("pista")
    return [
        *examples.shipped("bicycles", ".toml"), *examples.shipped("bicycle_text", ".txt"),
        examples.one("mine.toml", examples.documented()["bicycles"]["mine.toml"]),
        examples.one("pista.yml", to_yaml(pista)), examples.one("pista.txt", to_text(pista)),
    ]  # fmt: skip


def _histories(_: Path) -> list[Example]:
    files = examples.documented()
    return [examples.one("run01.csv", files["measurement_files/histories"]["run01.csv"]),
            examples.one("sweep.csv", files["measurement_files/replay"]["sweep.csv"])]  # fmt: skip


def _text_recordings(_: Path) -> list[Example]:
    return [e for e in recordings.written_recordings() if e.name.split()[0] in ("csv", "tsv", "tdx")]


def _binary_recordings(_: Path) -> list[Example]:
    return [e for e in recordings.written_recordings() if e.name.split()[0] not in ("csv", "tsv", "tdx")]


READERS: tuple[Reader, ...] = (
    Reader("bicycle", 15, reads.bicycle, _bicycle_files),
    Reader("table of bicycles", 6, reads.bicycles,
           lambda _: [examples.one("many.csv", examples.documented()["bicycles"]["many.csv"])]),
    Reader("model", 7, reads.model, lambda _: examples.models()),
    Reader("measurement", 3, reads.measurement, lambda _: examples.measurements()),
    Reader("tyre table", 6, reads.tyre, lambda _: examples.tyre_tables()),
    Reader(".tir", 6, reads.tyre, lambda _: examples.tyre_property_files()),
    Reader("Pacejka-89", 6, reads.tyre, lambda _: examples.coefficients()),
    Reader("sweep", 1.5, reads.sweep, lambda _: examples.sweeps()),
    Reader("costs", 12, reads.costs, lambda _: _starts("costs")),
    Reader("sensors", 12, reads.sensors, lambda _: _starts("sensors")),
    Reader("rider", 10, reads.rider, lambda _: examples.shipped("riders", ".txt")),
    Reader("seat", 10, reads.seat, lambda _: examples.shipped("riders/seat_geometry", ".toml")),
    Reader("rig recording", 2, reads.rig, lambda _: recordings.rig_recordings()),
    Reader("rig recording, fitted", 0.2, reads.fitted, lambda _: recordings.rig_recordings()),
    Reader("history", 4, reads.history, _histories),
    Reader("input history", 4, reads.input_of,
           lambda _: [examples.one("torque.csv", "time_s,steer_torque_N_m\n0,0\n0.1,1\n0.2,0.5\n0.3,0\n")]),
    Reader("address", 12, reads.address, _addresses),
    Reader("file dropped on the page", 4, reads.dropped, lambda f: [*_bicycle_files(f)[:4], *examples.models()[:3]]),
    Reader("recording, text formats", 2, reads.record, _text_recordings),
    Reader("recording, binary formats", 0.5, reads.record, _binary_recordings),
    Reader("result of a sweep", 0.1, reads.result, lambda _: recordings.results()),
    Reader("look", 0.1, reads.look, lambda f: [*_text_recordings(f)[::9], *_binary_recordings(f)[::9]]),
)  # fmt: skip
