"""Front frames of SYNTHETIC standing bicycles, known exactly: do `velotyre front-frame` and its intervals hold?

Bicycles without a rider; their true numbers differ from those of their files by the stated errors. Gauges, weights,
places and sensors have the errors that :class:`bicycle.standing.Errors` states. Counted are: the bias of stiffness and
damping, intervals that hold the truth, holds that give way and are named, holds named in vain, and the wobble of fronts
that sway.
"""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.standing_bench import Stand, perturbed
from tests.validation.standing_sway import sway, sway_summary

BICYCLES = ("browser", "crescendo", "fisher", "pista")
STEM, GROUND, HEAD = 0.6, -0.31, 0.55  # m above the hub
GAUGE = 5e-5  # m
LOAD = 98.1  # N
SD_OF_TAP = {"frequency": 1e-3, "damping": 0.03}  # relative
SD_OF_RATIO = 0.005
KEYS = {"stiffness": "front_compliance.stiffness", "damping": "front_compliance.damping"}
SETS = ("two deflections", "taps at hub and stem", "both", "one sensor", "mass on the stem")


def draw(seed: int) -> tuple[Any, Stand, Any]:
    """Draw a bicycle as its file has it, the same as it is with its front, and the source of its errors."""
    from bicycle.files import load_bicycle

    rng = np.random.default_rng([310461, seed])
    bicycle = load_bicycle(str(rng.choice(BICYCLES)))
    true = perturbed(bicycle.values, bicycle.sd, rng)
    stiffness = float(np.exp(rng.uniform(math.log(800.0), math.log(15000.0))))
    ratio = float(np.exp(rng.uniform(math.log(0.005), math.log(0.3))))
    height = float(rng.uniform(0.2, 0.55))
    stand = Stand(true, stiffness, 0.0, height)
    (mass,), _, (spring,) = (part[0] for part in stand.matrices(upright=True))
    return bicycle, Stand(true, stiffness, 2 * ratio * math.sqrt(spring * mass), height), rng


class Owner:
    """Someone with two weights, a gauge and two sensors, who misplaces each of them a little."""

    def __init__(self, stand: Stand, rng: Any) -> None:
        from bicycle.standing import Errors

        self.stand, self.rng, self.errors = stand, rng, Errors()
        self._offsets: dict[float, float] = {}
        self._load = LOAD * (1 + self.errors.load * float(rng.standard_normal()))
        self._gain = 1 + self.errors.gain * float(rng.standard_normal())

    def true_place(self, above: float) -> float:
        """Where something is that is said to be ``above`` the hub (m)."""
        if above and above not in self._offsets:
            self._offsets[above] = above + self.errors.place * float(self.rng.standard_normal())
        return self._offsets.get(above, above)

    def deflections(self, pairs: Sequence[tuple[float, float]], *, frame: bool = False) -> tuple[Any, ...]:
        """Deflections of load and gauge, both m above the hub; with one of the head tube under the last load."""
        from bicycle.standing import Deflection

        rows = [(loaded, read, False) for loaded, read in pairs]
        rows += [(pairs[-1][0], HEAD, True)] if frame else []
        readings = []
        for loaded, read, on_frame in rows:
            way = self.stand.deflection(
                self._load, self.true_place(loaded), self.true_place(read), on_frame=on_frame
            ) + GAUGE * float(self.rng.standard_normal())
            readings.append(Deflection(LOAD, place(loaded), place(read, on_frame=on_frame), way, GAUGE))
        return tuple(readings)

    def tap(
        self, *, sensors: tuple[float, ...] = (STEM,), added: tuple[float, float] = (0.0, 0.0), frame: bool = False
    ) -> Any:
        """Numbers of one tap: at the hub and at further sensors, perhaps with a mass on the front."""
        from bicycle.standing import Ratio, Tap

        spots = [(above, False) for above in sensors] + ([(HEAD, True)] if frame else [])
        true_spots = [(0.0, False), *((self.true_place(above), on_frame) for above, on_frame in spots)]
        hertz, ratio, moves = self.stand.vibration(true_spots, (added[0], self.true_place(added[1])))
        sds = SD_OF_TAP["frequency"] * hertz, SD_OF_TAP["damping"] * ratio
        noise = self.rng.standard_normal(2 + len(moves))
        ratios = tuple(
            Ratio(place(above, on_frame=on_frame), place(0.0), self._gain * move + SD_OF_RATIO * error, SD_OF_RATIO)
            for (above, on_frame), move, error in zip(spots, moves, noise[2:], strict=True)
        )
        frequency, damping = hertz + sds[0] * noise[0], ratio + sds[1] * noise[1]
        return Tap("tap", frequency, sds[0], damping, sds[1], ratios, added[0], place(added[1]))

    def recorded_taps(self, number: int) -> tuple[Any, ...]:
        """Taps at hub and stem as they come out of recordings."""
        from bicycle.standing import TapRecording, identify_taps

        columns = ("hub_lateral_m_s2", "stem_lateral_m_s2")
        recordings = []
        for k in range(number):
            table = self.stand.recording([0.0, self.true_place(STEM)], self.rng)
            signals = {name: table[f"place_{j}"] for j, name in enumerate(columns)}
            signals[columns[1]] = self._gain * signals[columns[1]]
            recordings.append(TapRecording(f"tap{k}", table["time_s"], signals))
        return identify_taps(recordings, dict(zip(columns, (place(0.0), place(STEM)), strict=True)))


def place(above: float, *, on_frame: bool = False) -> Any:
    """A place as its owner names it."""
    from bicycle.standing import Place

    return Place(above, "frame" if on_frame else "wheel" if above <= 0.3 else "fork")


def one_hinge(seed: int) -> list[dict[str, Any]]:
    """One front, measured in five ways: what is found, and whether its intervals hold the truth."""
    from bicycle import Model
    from bicycle.standing import Readings, measure_front

    bicycle, stand, rng = draw(seed)
    owner = Owner(stand, rng)
    deflections = owner.deflections([(GROUND, 0.0), (GROUND, STEM)])
    taps = owner.recorded_taps(2)
    alone = owner.tap(sensors=())
    heavy = owner.tap(sensors=(), added=(1.0, STEM))
    ways = {
        "two deflections": Readings(deflections, on_side=True),
        "taps at hub and stem": Readings((), taps),
        "both": Readings(deflections, taps),
        "one sensor": Readings((), (alone,)),
        "mass on the stem": Readings((), (alone, heavy)),
    }
    rows = []
    for name, readings in ways.items():
        result = measure_front(readings, Model(bicycle))
        rows.append({"seed": seed, "set": name, "outcome": str(result.outcome)} | judge(result, stand))
    return rows


def judge(result: Any, stand: Stand) -> dict[str, Any]:
    """Errors of a result, and whether its 95 % intervals hold the truth."""
    fit = result.fit
    if fit is None:
        return {}
    row: dict[str, Any] = {"height_assumed": fit.height_assumed}
    for name, true in (("stiffness", stand.stiffness), ("damping", stand.damping)):
        if name == "damping" and not result.readings.damped:
            continue
        low, high = fit.value_interval(KEYS[name])
        row |= {f"{name}_error": fit.values[KEYS[name]] / true - 1, f"{name}_holds": low <= true <= high}
        row[f"{name}_relative_sd"] = fit.sd(KEYS[name]) / fit.values[KEYS[name]]
    height, sd = fit.height
    row |= {"height_error": height - stand.height, "height_holds": abs(height - stand.height) <= 1.96 * sd}
    return row


def support(seed: int) -> list[dict[str, Any]]:
    """One front in a hold of 4 to 60 kN m/rad, and in a firm one: is the hold named?"""
    from bicycle import Model
    from bicycle.standing import Readings, measure_front

    bicycle, held, rng = draw(seed)
    rotation = float(np.exp(rng.uniform(math.log(4e3), math.log(6e4))))
    lateral = float(np.exp(rng.uniform(math.log(1e5), math.log(1e6))))
    loose = Stand(held.p, held.stiffness, held.damping, held.height, rotation, lateral)
    rows = []
    for stand in (loose, held):
        owner = Owner(stand, rng)
        pairs = [(0.0, 0.0), (GROUND, 0.0), (GROUND, GROUND)]
        deflections, taps = owner.deflections(pairs), (owner.tap(),)
        ways = {
            "frame read": Readings(owner.deflections(pairs, frame=True), (owner.tap(frame=True),)),
            "deflections and taps": Readings(deflections, taps),
            "taps alone": Readings((), taps),
        }
        for name, readings in ways.items():
            result = measure_front(readings, Model(bicycle))
            error = result.fit.values[KEYS["stiffness"]] / held.stiffness - 1 if result.fit else None
            rows.append(
                {"seed": seed, "set": name, "loose": stand is loose, "rotation": rotation, "stiffness": held.stiffness,
                 "outcome": str(result.outcome), "checked": result.hold_checked, "stiffness_error": error}
            )  # fmt: skip
    return rows


def run(
    *, out: Path, seed: int, fronts: int = 200, holds: int = 100, sways: int = 100, workers: int = 2
) -> dict[str, Any]:
    """Measure ``fronts`` in five ways, ``holds`` in three, ``sways`` by taps; every case goes to a file."""
    from bicycle.effects import model_workers

    with model_workers(workers) as pool:
        hinges = [row for rows in pool.map(one_hinge, range(seed, seed + fronts)) for row in rows]
        loose = [row for rows in pool.map(support, range(seed, seed + holds)) for row in rows]
        swaying = list(pool.map(sway, range(seed, seed + sways)))
    lines = "".join(json.dumps(row) + "\n" for row in [*hinges, *loose, *swaying])
    (out / "standing_cases.jsonl").write_text(lines, encoding="utf-8")
    return {
        "one hinge": {name: summary([row for row in hinges if row["set"] == name]) for name in SETS},
        "hold": hold_summary(loose),
        "two joints": sway_summary(swaying),
    }


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Bias, scatter and coverage of one way of measuring."""
    from tests.validation.cases import share

    used = [row for row in rows if row["outcome"] == "one_hinge"]
    result: dict[str, Any] = {"fronts": len(rows), "one_hinge": len(used)}
    for name in ("stiffness", "damping", "height"):
        errors = np.array([row[f"{name}_error"] for row in used if f"{name}_error" in row])
        if not len(errors):
            continue
        holds = [row[f"{name}_holds"] for row in used]
        result[name] = {
            "bias": round(float(errors.mean()), 5),
            "bias_standard_error": round(float(errors.std() / math.sqrt(len(errors))), 5),
            "median_error": round(float(np.median(errors)), 5),
            "rms": round(float(np.sqrt((errors**2).mean())), 5),
            "holds": share(sum(holds), len(holds)),
        }
        sds = [row[f"{name}_relative_sd"] for row in used if f"{name}_relative_sd" in row]
        if sds:
            result[name]["median_stated_sd"] = round(float(np.median(sds)), 4)
    return result


def hold_summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """How often a hold that gives way is named, and a firm one is."""
    from tests.validation.cases import share

    result = {}
    for name in dict.fromkeys(row["set"] for row in rows):
        chosen = [row for row in rows if row["set"] == name]
        loose, firm = ([row for row in chosen if row["loose"] is flag] for flag in (True, False))
        result[name] = {
            "named": share(sum(row["outcome"] == "not_held" for row in loose), len(loose)),
            "no_numbers": share(sum(row["stiffness_error"] is None for row in loose), len(loose)),
            "false_alarms": share(sum(row["outcome"] != "one_hinge" for row in firm), len(firm)),
            "says_unchecked": share(sum(row["checked"] == "" for row in loose), len(loose)),
        }
    return result
