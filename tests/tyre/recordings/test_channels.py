"""From signals to records: units, scales, signs, clocks, rates, sensors that are turned, events; what is refused."""

import math

import numpy as np
import pytest

from tests.shared.refusals import refuses
from tyre.formats import ChannelMap, Signal, Signals
from tyre.ground import InputError, find_unit, quantity_of
from tyre.recordings import check_clock, fills, how_to, records

QUANTITIES = {"force": "force", "angle": "angle", "rate": "angular rate", "temperature": "temperature"}
N = 200
TIME = np.arange(N) / 100


def signals(**given):
    """Each NAME = (values, unit) or (values, unit, own time)."""
    return Signals("f", {name: Signal(name, np.asarray(x[0], float), *x[1:]) for name, x in given.items()})


def a_map(folder=None, **tables):
    return ChannelMap.from_table(tables, folder, where="map")


def one(given, **tables):
    (record,) = records(given, a_map(**tables), QUANTITIES)
    return record


@pytest.mark.parametrize(
    ("quantity", "unit", "size"),
    [  # NIST SP 811 (2008), appendix B; other spellings of what tests/tyre/test_units.py holds against a second source
        ("angle", "°", math.pi / 180), ("angular rate", "°/s", math.pi / 180), ("acceleration", "m/s²", 1),
        ("moment", "N·m", 1), ("moment", "N*mm", 1e-3), ("moment", "lbf·ft", 1.3558179483314),
        ("moment", "kgf·m", 9.80665), ("pressure", "kgf/cm²", 98066.5), ("length", "µm", 1e-6), ("time", "µs", 1e-6),
    ],
)  # fmt: skip
def test_units_by_name(quantity, unit, size):
    assert find_unit(unit, quantity, where="f").factor == pytest.approx(size, rel=1e-12)
    assert quantity_of(unit) == quantity


def test_units_signs_scales_and_offsets():
    raw = np.linspace(0, 1023, N)
    given = signals(
        t=(1e3 * TIME, "ms"), F=(raw, "kN"), a=(raw, ""), T=(raw, "degF"), counts=(raw, "counts"), volts=(raw, "V")
    )
    record = one(
        given,
        channels={
            "time": {"column": "t"}, "force": {"column": "F", "sign": -1}, "angle": {"column": "a", "unit": "deg"},
            "temperature": {"column": "T"},
        },
    )  # fmt: skip
    np.testing.assert_allclose(record.time, TIME, rtol=1e-14)
    np.testing.assert_allclose(record.values["force"], -1e3 * raw)
    np.testing.assert_allclose(record.values["angle"], np.deg2rad(raw))
    np.testing.assert_allclose(record.values["temperature"], (raw - 32) * 5 / 9, atol=1e-12)
    scaled = {"column": "counts", "unit": "kN", "scale": 0.5, "offset": -3, "sign": -1}
    record = one(given, channels={"time": "t", "force": scaled})
    np.testing.assert_allclose(record.values["force"], -1e3 * (0.5 * raw - 3))
    record = one(given, channels={"time": "t", "force": {"column": "volts", "unit": "N", "scale": 100}})
    np.testing.assert_allclose(record.values["force"], 100 * raw)
    record = one(given, channels={"time": "t", "force": {"column": "F", "unit": "N", "instead_of": "kN"}})
    np.testing.assert_allclose(record.values["force"], raw)
    assert given["F"].values[5] == raw[5]  # signals are left as they are


@pytest.mark.parametrize(("entry", "words"), [
    ({"column": "a"}, r"force \(column a\): the file states no unit; add unit"),
    ({"column": "F", "unit": "N"}, "the file states 'kN', the channel map 'N'; take the unit out"),
    ({"column": "v", "unit": "N"}, "the file states 'V', the channel map 'N'"),
    ({"column": "F", "unit": "deg"}, "unit 'deg' is not a unit of force"),
    ({"column": "v"}, "unit 'V' is not a unit of force"),
    ({"column": "F", "unit": "N", "instead_of": "lbf"}, "instead_of = 'lbf', but the file states 'kN'"),
    ({"column": "G"}, "no column 'G' that holds numbers; there are t, F, a, v, e, i, w, z, u"),
    ({"column": "e"}, "has no valid sample"), ({"column": "i"}, "is infinite in sample 4"),
    ({"column": "w"}, r"reaches 1e\+40 in SI units, beyond any sensor"),
    ({"column": "u"}, r"reaches 1e\+40 in SI units, beyond any sensor"),
    ({"column": "z"}, r"different numbers of samples \(force 0, time 200\)|holds no samples"),
])  # fmt: skip
def test_channels_that_are_refused(entry, words):
    inf, wild = np.zeros(N), np.zeros(N)
    inf[3], wild[3] = np.inf, 1e40
    given = signals(
        t=(TIME, "s"), F=(TIME, "kN"), a=(TIME, ""), v=(TIME, "V"), e=(np.full(N, np.nan), "N"), i=(inf, "N"),
        w=(wild, "N"), z=([], "N"), u=(-wild, "N"),
    )  # fmt: skip
    refuses(words, one, given, channels={"time": "t", "force": entry})


def test_flipped_bits_of_a_number_are_no_warning():
    """A signalling NaN is a missing sample, and what overflows in SI units is told as infinite."""
    force = np.linspace(1, 2, N)
    force[7] = np.array(0x7FF0000000000001, np.uint64).view(np.float64)
    given = signals(t=(TIME, "s"), F=(force, "kN"))
    found = one(given, channels={"time": "t", "force": "F"})
    assert np.isnan(found.values["force"]).nonzero()[0].tolist() == [7]
    huge = signals(t=(TIME, "s"), F=(np.full(N, 1e308), "kN"))
    refuses("is infinite in sample 1", one, huge, channels={"time": "t", "force": "F"})


# Clocks


@pytest.mark.parametrize(("time", "expected"), [
    ({"rate_hz": 50}, np.arange(N) / 50),
    ({"index": "n", "rate_hz": 200}, np.arange(N) / 200),
    ({"column": "t"}, TIME), ({"column": "h", "unit": "h"}, TIME),
])  # fmt: skip
def test_where_the_time_comes_from(time, expected):
    given = signals(t=(TIME, "s"), F=(TIME, "N"), n=(np.arange(N) + 77, "-"), h=(TIME / 3600, ""))
    np.testing.assert_allclose(one(given, channels={"time": time, "force": "F"}).time, expected, rtol=1e-12)


@pytest.mark.parametrize(("change", "words"), [
    (lambda t: np.where(np.arange(N) > 90, t - 0.3, t), "time runs back at 1 samples, first at sample 92"),
    (lambda t: np.floor(t * 20) / 20, "time repeats at 160 samples, first at sample 2"),
    (lambda t: np.where(np.arange(N) % 190 == 7, np.nan, t), "time is missing in 2 of 200 samples, first in sample 8"),
    (lambda t: t[::-1], "time runs back at 199 samples"),
    (lambda t: np.zeros(N), "time repeats at 199 samples"),
    (lambda t: 1e-200 * t, r"time has 1e\+202 samples a second, which no logger takes; check its unit"),
    (lambda t: 1e9 * (t + 1.7e9), r"time reaches 1.7e\+18 s, which is no date; check its unit"),
])  # fmt: skip
def test_clocks_that_would_give_wrong_results_are_refused(change, words):
    refuses(words, one, signals(t=(change(TIME), "s"), F=(TIME, "N")), channels={"time": "t", "force": "F"})


def test_oddities_of_a_clock_are_said():
    rng = np.random.default_rng(3)
    assert check_clock(TIME, where="f") == ()
    assert check_clock(TIME + rng.uniform(0, 2e-5, N), where="f") == ()
    (uneven,) = check_clock(TIME + rng.uniform(0, 3e-3, N), where="f")
    assert uneven.startswith("time is uneven: its steps range from 0.00")
    drifting = np.cumsum(np.linspace(0.01, 0.0102, 1000))
    assert check_clock(drifting, where="f") == (
        "the sample time drifts from 0.01001 to 0.0101902 s over the recording",
    )


def test_a_time_of_the_calendar_is_counted_from_the_first_sample():
    record = one(signals(t=(1.7e9 + TIME, "s"), F=(TIME, "N")), channels={"time": "t", "force": "F"})
    assert record.time[0] == 0
    np.testing.assert_allclose(record.time, TIME, atol=3e-7)
    assert record.notes == ("time is counted from its first sample, 1700000000 s",)


@pytest.mark.parametrize(("columns", "time", "words"), [
    ({"t": (TIME, "")}, {"column": "t"}, "the file states no unit of time; add unit"),
    ({"t": (TIME, "ms")}, {"column": "t", "unit": "s"}, "the file states 'ms', the channel map 's'"),
    ({"t": (TIME, "datetime")}, {"column": "t", "unit": "s"}, "the column holds dates"),
    ({"t": (TIME, "s")}, {"column": "t", "unit": "datetime"}, "the column holds no dates"),
    ({"t": (TIME, "")}, {"index": "t", "rate_hz": 10}, "t does not count samples: it must hold whole numbers"),
    ({"t": (TIME[:50], "s")}, {"column": "t"}, r"different numbers of samples \(force 200, time 50\), so not one"),
    ({}, None, "the file gives no times of force; add time"),
])  # fmt: skip
def test_times_that_are_refused(columns, time, words):
    channels = {"force": "F"} | ({"time": time} if time else {})
    refuses(words, one, signals(F=(TIME, "N"), **columns), channels=channels)


# Rates


def two_rates():
    slow = np.arange(0, 2, 0.05) + 0.003
    return signals(F=(np.sin(TIME), "N", TIME), a=(3 * slow + 1, "rad", slow))


def test_channels_of_several_rates_are_refused_unless_resampling_is_asked_for():
    channels = {"force": "F", "angle": "a"}
    with pytest.raises(InputError, match=r"sampled at different times \(force 200 samples, angle 40 samples\); write"):
        one(two_rates(), channels=channels)
    record = one(two_rates(), channels=channels, resampling={"rate_hz": 80})
    np.testing.assert_allclose(np.diff(record.time), 1 / 80)
    np.testing.assert_allclose(record.values["angle"], 3 * record.time + 1, rtol=1e-12)
    assert (record.time[0], record.time[-1]) == (0.003, pytest.approx(1.953, abs=1 / 80))
    assert record.notes == (
        "force: resampled from 100 Hz to 80 Hz by linear interpolation; no filter was applied, faster oscillations are "
        "mirrored",
        "angle: resampled from 20 Hz to 80 Hz by linear interpolation",
    )
    record = one(two_rates(), channels=channels, resampling={"like": "force"})
    np.testing.assert_allclose(record.values["force"], np.sin(record.time))


def test_the_rate_that_is_advised_is_that_of_the_fastest_channel_without_what_was_dropped():
    with pytest.raises(InputError, match=r"write \[resampling\] with rate_hz = 100 \(linear interp.*, or like ="):
        one(two_rates(), channels={"force": "F", "angle": "a"})
    stamps = np.delete(np.round(np.arange(600) / 60, 3), [50, 51, 200, 431])  # 60 Hz, to the ms
    assert how_to(stamps) == "write [resampling] with rate_hz = 60 (linear interpolation)"
    assert fills(stamps, stamps)


def test_what_is_at_even_steps_already_stays_as_it_is_and_what_is_missing_there_is_filled():
    stamps = TIME * 1.0000001
    holes = np.sin(TIME)
    holes[[7, 120, 121]] = np.nan
    given = signals(t=(stamps, "s"), F=(np.cos(TIME), "N"), a=(holes, "rad"))
    channels = {"time": {"column": "t"}, "force": "F", "angle": "a"}
    record = one(given, channels=channels, resampling={"rate_hz": 100})
    assert record.notes == ("angle: 3 of 3 missing samples filled by linear interpolation",)
    np.testing.assert_array_equal(record.values["force"], np.cos(TIME))
    np.testing.assert_allclose(record.values["angle"], np.sin(TIME), atol=0.03**2 / 8)  # of a sine, over 0.03
    moved = one(signals(t=(TIME + 0.003 * np.sin(20 * np.pi * TIME / TIME[-1]), "s"), F=(TIME, "N")),
                channels={"time": {"column": "t"}, "force": "F"}, resampling={"rate_hz": 100})  # fmt: skip
    assert [note for note in moved.notes if "Hz" in note] == [
        "force: put at even steps of 100 Hz by linear interpolation"
    ]  # fmt: skip


def test_nothing_is_made_up_in_a_gap():
    gap = np.delete(TIME, slice(80, 120))
    given = signals(F=(gap, "N", gap), a=(TIME, "rad", TIME))
    record = one(given, channels={"force": "F", "angle": "a"}, resampling={"like": "angle"})
    missing = np.isnan(record.values["force"])
    assert missing.sum() == 40
    np.testing.assert_allclose(record.values["force"][~missing], record.time[~missing])


def test_two_samples_are_enough_to_resample():
    given = signals(F=(TIME, "N", TIME), a=(TIME, "rad", TIME))
    step = 0.9 * (TIME[-1] - TIME[0])
    record = one(given, channels={"force": "F", "angle": "a"}, resampling={"rate_hz": 1 / step})
    np.testing.assert_allclose(record.time - record.time[0], [0.0, step])


@pytest.mark.parametrize(
    ("resampling", "words"),
    [({"like": "slip"}, "like = 'slip' is no channel"), ({"rate_hz": 0.1}, "only 1 samples after resampling")],
)
def test_resampling_that_is_refused(resampling, words):
    refuses(words, one, two_rates(), channels={"force": "F", "angle": "a"}, resampling=resampling)


# Sensors that are turned

TRIPLE = {"time": "t", "x": "gx", "rate": "gy", "z": "gz"}


def gyro(vector):
    return signals(
        t=(TIME, "s"), **{f"g{axis}": (np.full(N, x), "deg/s") for axis, x in zip("xyz", vector, strict=True)}
    )


@pytest.mark.parametrize(
    ("mounting", "expected"),
    [  # a sensor that turns about its own x alone, seen in the axes of the vehicle
        ({"angles_deg": [90, 0, 0], "order": "ZYX"}, 1.0),  # yawed to the left: its x points along y
        ({"angles_deg": [0, 0, 90], "order": "ZYX"}, 0.0),  # rolled: its x stays
        ({"angles_deg": [30, 0, 0], "order": "zyx"}, 0.5),
        ({"matrix": [[0, -1, 0], [1, 0, 0], [0, 0, 1]]}, 1.0),
        ({"matrix": [[0.866, -0.5, 0], [0.5, 0.866, 0], [0, 0, 1]]}, 0.5),  # rounded
    ],
)
def test_a_turned_sensor(mounting, expected):
    record = one(gyro([1, 0, 0]), channels=TRIPLE, mounting=[{"channels": ["x", "rate", "z"], **mounting}])
    np.testing.assert_allclose(record.values["rate"], np.deg2rad(expected), atol=1e-6)
    assert set(record.values) == {"rate"}


def test_capital_and_small_orders_are_not_the_same():
    found = [
        one(gyro([0, 0, 1]), channels=TRIPLE,
            mounting=[{"channels": ["x", "rate", "z"], "angles_deg": [90, 0, 90], "order": order}]).values["rate"][0]
        for order in ("ZYX", "zyx")
    ]  # fmt: skip
    # z of the sensor. ZYX: rolled by 90 deg about the x that was yawed to the left, z ends up along x: no y.
    # zyx: yawed about the fixed z first, then rolled by 90 deg about the fixed x: z ends up along -y.
    np.testing.assert_allclose(found, [0, -np.pi / 180], atol=1e-12)


@pytest.mark.parametrize(("channels", "names", "words"), [
    (TRIPLE, ["x", "rate", "y"], "turns y, which is not in"),
    ({**TRIPLE, "force": "gx"}, ["x", "z", "nothing"], "turns nothing, which is not in"),
    ({"time": "t", "x": "gx", "y": "gy", "z": "gz"}, ["x", "y", "z"], "none is a channel that is used"),
    ({"time": "t", "angle": "gx", "rate": "gy", "z": "gz"}, ["angle", "rate", "z"], "measure angle and angular"),
])  # fmt: skip
def test_triples_that_are_refused(channels, names, words):
    mounting = [{"channels": names, "angles_deg": [0, 0, 0], "order": "xyz"}]
    refuses(words, one, gyro([1, 0, 0]), channels=channels, mounting=mounting)


# Events


def test_windows_by_time():
    given = signals(t=(TIME + 5, "s"), F=(TIME, "N"))
    windows = [{"name": "a", "from_s": 0.5, "to_s": 1.0}, {"from_s": 1.5}]
    first, second = records(given, a_map(channels={"time": "t", "force": "F"}, windows=windows), QUANTITIES)
    assert (first.source, first.event, second.event) == ("f#a", "a", "2")
    np.testing.assert_allclose(first.values["force"], TIME[50:101])
    np.testing.assert_allclose(second.time, TIME[150:] + 5)


def trigger(**given):
    return [{"name": "kick", "trigger": {"channel": "force", "unit": "kN", "after_s": 0.1, **given}}]


@pytest.mark.parametrize("begin", [0.0, 5.0, 1.7e9])  # s, of the clock of a test bench, or since 1970
def test_events_by_a_trigger(begin):
    force = np.zeros(N)
    force[[3, 50, 52, 120, 197]] = 2500.0
    given = signals(t=(TIME + begin, "s"), F=(force, "N"), a=(TIME, "rad"))
    made = a_map(channels={"time": "t", "force": "F", "angle": "a"}, windows=trigger(above=2.0, before_s=0.05))
    found = records(given, made, QUANTITIES)
    assert [record.event for record in found] == ["kick.1", "kick.2"]
    np.testing.assert_allclose(found[0].values["angle"], TIME[45:61])
    assert "2 events of window 'kick' are cut off by an end of the recording: rejected" in found[0].notes
    made = a_map(channels={"time": "t", "force": {"column": "F", "sign": -1}}, windows=trigger(below=-2.0))
    assert len(records(given, made, QUANTITIES)) == 3


@pytest.mark.parametrize("begin", [0.0, 5.0])  # s
@pytest.mark.parametrize(("windows", "words"), [
    (trigger(above=9.0), "force gives no event: it ranges from 0 to 1990 and the level is 9000, in SI units"),
    ([{"from_s": 1, "to_s": 3}], r"window '1' from 1 to 3 s is not inside the recording, which lasts 1.99 s"),
    ([{"from_s": 1.0001, "to_s": 1.0002}], "event 1 holds 0 samples; make its window longer"),
    ([{"trigger": {"channel": "kick", "above": 1, "unit": "N", "after_s": 1}}], "triggered by kick, which is not"),
])  # fmt: skip
def test_events_that_are_refused(windows, words, begin):
    given = signals(t=(TIME + begin, "s"), F=(1000 * TIME, "N"))
    refuses(words, records, given, a_map(channels={"time": "t", "force": "F"}, windows=windows), QUANTITIES)
