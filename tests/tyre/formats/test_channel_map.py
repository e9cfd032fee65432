"""Channel maps of files and of the command line: what they say, and what is refused."""

import pytest

from tests.shared.refusals import refuses
from tyre.formats import ChannelMap, Clock, Column, MappedColumn, Reading, Trigger, Window, find_column
from tyre.ground import InputError
from tyre.recordings import draft_map

LAB = """
[channels]
time = {column = "t", unit = "ms"}
roll_rate = {column = "IMU.gyro_x", unit = "deg/s", sign = -1}
steer = "Lenkwinkel"
[reading]
delimiter = ";"
dbc = ["bus.dbc"]
[[mounting]]
channels = ["roll_rate", "pitch_rate", "yaw_rate"]
angles_deg = [1, 2, 3]
order = "ZYX"
[resampling]
rate_hz = 200
[[windows]]
name = "a"
from_s = 1
to_s = 2
[[windows]]
trigger = {channel = "steer", above = 3, unit = "deg", before_s = 1, after_s = 2}
"""


def test_a_map_of_a_file(tmp_path):
    (tmp_path / "lab.toml").write_text(LAB)
    found = ChannelMap.from_table({"channels": "lab.toml"}, tmp_path, where="run.toml")
    assert found.channels == {
        "roll_rate": MappedColumn("IMU.gyro_x", "deg/s", -1.0), "steer": MappedColumn("Lenkwinkel"),
    }  # fmt: skip
    assert found.clock == Clock("t", "ms")
    assert found.reading == Reading(delimiter=";", dbc=(tmp_path / "bus.dbc",))
    assert found.resampling.rate == 200
    assert found.windows == (Window("a", 1, 2), Window("2", trigger=Trigger("steer", 3, True, "deg", 1, 2)))
    own = {"channels": "lab.toml", "windows": [{"from_s": 5}]}
    assert ChannelMap.from_table(own, tmp_path, where="run.toml").windows == (Window("1", 5),)
    assert set(found.only(["steer"]).channels) == {"steer"}
    assert set(found.only(["roll_rate"]).channels) == {"roll_rate", "steer"}  # which triggers the events


@pytest.mark.parametrize(("text", "name", "expected"), [
    ("roll_rate=IMU.gyro_x deg/s -1", "roll_rate", MappedColumn("IMU.gyro_x", "deg/s", -1.0)),
    ("roll_rate = 'Gyro X' deg/s", "roll_rate", MappedColumn("Gyro X", "deg/s")),
    ("torque=T 'N m' +1", "torque", MappedColumn("T", "N m")),
    ("steer=d -1", "steer", MappedColumn("d", "", -1.0)),
    ("steer=d", "steer", MappedColumn("d")),
    # as the heading has it, without quotes
    ("steer_rate=Gyroscope z (deg/s)", "steer_rate", MappedColumn("Gyroscope z", "(deg/s)")),
    ("lean=Tilt about x axis [rad] -1", "lean", MappedColumn("Tilt about x axis", "[rad]", -1.0)),
    ("steer=a(b)", "steer", MappedColumn("a(b)")),
])  # fmt: skip
def test_channels_of_the_command_line(text, name, expected):
    assert ChannelMap().with_channels([text]).channels == {name: expected}


@pytest.mark.parametrize(
    ("text", "expected"),
    [("time=200 Hz", Clock(rate=200)), ("time=t", Clock("t")), ("time='T 1' ms", Clock("T 1", "ms"))],
)
def test_times_of_the_command_line(text, expected):
    assert ChannelMap().with_channels([text]).clock == expected


@pytest.mark.parametrize(("texts", "words"), [
    (["roll_rate"], "channel 'roll_rate': write NAME=COLUMN"),
    (["=x"], "write NAME=COLUMN"), (["a='x"], "write NAME=COLUMN"), (["a=x deg 2"], "the sign '2' must be 1 or -1"),
    (["a=x", "a=y"], "channel 'a=y': a is given twice"),
    (["time=0 Hz"], "'0' is no rate; write time=200 Hz"),
    (["time=fast Hz"], "'fast' is no rate"),
    (["time=t ms -1"], r"write time=COLUMN \[UNIT\] or time=RATE Hz"),
])  # fmt: skip
def test_texts_that_are_refused(texts, words):
    refuses(words, ChannelMap().with_channels, texts)


def column(**keys):
    return {"channels": {"steer": {"column": "d", **keys}}}


def mounting(**keys):
    return {"mounting": [{"channels": ["x", "y", "z"], **keys}]}


def window(**keys):
    return {"windows": [keys]}


SPIN = {"channel": "x", "unit": "N", "after_s": 1}


@pytest.mark.parametrize(("content", "words"), [
    ({"chanels": {}}, r"unknown table 'chanels'; did you mean 'channels'\?"),
    ({"channels": 3}, "must be a table"),
    ({"channels": {"steer": {"unit": "deg"}}}, 'column is missing; write column = "NAME"'),
    (column(units="deg"), r"unknown key 'units'; did you mean 'unit'\?"),
    (column(sign=2), "sign = 2 must be 1 or -1"),
    (column(sign=True), "sign = True must be 1 or -1"),
    (column(unit=""), "unit is empty"),
    (column(scale=0, unit="N"), "steer: scale = 0 makes every sample the same"),
    (column(scale=2), "scale and offset need the unit of their result"),
    (column(instead_of="deg"), "instead_of needs the right unit"),
    ({"channels": {"time": {"column": "t", "rate_hz": 2}}}, "give either a column, or a rate_hz"),
    ({"channels": {"time": {}}}, "give column = NAME with its unit, rate_hz"),
    ({"channels": {"time": {"index": "n"}}}, "give column = NAME with its unit, rate_hz"),
    ({"channels": {"time": {"rate_hz": 2, "unit": "s"}}}, "unit belongs to a column of times"),
    ({"channels": {"time": {"rate_hz": 0}}}, "rate_hz = 0 must be a finite number above 0"),
    ({"reading": {"delimiter": "::"}}, "delimiter = '::' must be one character in quotes, \""),
    ({"reading": {"decimal": ";"}}, "decimal = ';' must be"),
    ({"reading": {"names_line": 0}}, "names_line = 0 must be a whole number from 1"),
    ({"reading": {"dbc": "a.dbc"}}, "dbc = 'a.dbc' must be a list of files"),
    ({"mounting": {}}, "must be tables: write"),
    (mounting(), "give the rotation either as matrix or as angles_deg"),
    (mounting(angles_deg=[1, 2, 3]), 'angles_deg needs its order, such as order = "ZYX"'),
    (mounting(angles_deg=[1, 2, 3], order="ZyX"), "order = 'ZyX' must be three axes"),
    (mounting(angles_deg=[1, 2], order="ZYX"), r"angles_deg = \[1, 2\] must be three angles"),
    (mounting(matrix=[[1, 0, 0], [0, 1, 0]]), "matrix = .* must be three rows of three numbers"),
    (mounting(matrix=[[1, 0, 0], [0, 1, 0.1], [0, 0, 1]]), "not three perpendicular unit vectors"),
    (mounting(matrix=[[1, 0, 0], [0, 1, 0], [0, 0, -1]]), "matrix mirrors"),
    (mounting(matrix=[[1, 0, 0], [0, 1, 0], [0, 0, 1]], order="ZYX"), "order belongs to angles_deg"),
    (mounting(angles_deg=[1, 2, 3], order="ZYX", sd_deg=-1), "sd_deg = -1 must be"),
    (mounting(angles_deg=[1, 2, 3], order="ZYX", sd_deg=90.5), "sd_deg = 90.5 must be"),
    ({"mounting": [{"channels": ["x", "x", "z"], "angles_deg": [1, 2, 3], "order": "ZYX"}]}, "a channel twice"),
    ({"mounting": [{"channels": ["x", "y"]}]}, "must be three names of channels"),
    ({"mounting": [{}]}, "channels is missing; name the three channels"),
    ({"resampling": {}}, "give either rate_hz or like"),
    ({"resampling": {"rate_hz": 2, "like": "x"}}, "give either rate_hz or like"),
    ({"windows": {"from_s": 1}}, "must be tables: write"),
    (window(), "give either from_s and to_s, or a trigger"),
    (window(from_s=1, trigger=SPIN | {"above": 1}), "give either from_s and to_s, or a trigger"),
    (window(from_s=2, to_s=1), "to_s = 1 must be later than from_s = 2"),
    (window(from_s=2, to_s=2), "to_s = 2 must be later than from_s = 2"),
    ({"windows": [{"name": "a", "from_s": 1}, {"name": "a", "from_s": 2}]}, "the name 'a' is given twice"),
    (window(trigger=SPIN), "a trigger needs one level, above or below"),
    (window(trigger=SPIN | {"above": 1, "below": 1}), "a trigger needs one level"),
    (window(trigger={"unit": "N", "above": 1, "after_s": 1}), "channel is missing; name the channel"),
    (window(trigger={"channel": "x", "above": 1, "after_s": 1}), "unit is missing; give the unit of the level"),
    (window(trigger={"channel": "x", "above": 1, "unit": "N"}), "after_s is missing; state how long"),
])  # fmt: skip
def test_maps_that_are_refused(content, words, tmp_path):
    with pytest.raises(InputError, match=words) as told:
        ChannelMap.from_table(content, tmp_path, where="lab.toml")
    assert str(told.value).startswith("lab.toml: ")


def test_files_that_are_refused(tmp_path):
    refuses("no such channel map", ChannelMap.from_file, tmp_path / "lab.toml")
    (tmp_path / "lab.toml").write_text('channels = "other.toml"')
    refuses(r"channels = 'other.toml' must be a table: write \[channels\]", ChannelMap.from_file, tmp_path / "lab.toml")


COLUMNS = (Column("IMU/gyro", "deg/s"), Column("Rig/gyro", "deg/s"), Column("Rig/F y", "N"))


def test_columns_are_found_by_any_spelling():
    for spelling in ("Rig/F y", "F y", "F y [N]", "F  y (N)"):
        assert find_column(spelling, COLUMNS, where="f") == "Rig/F y"
    with pytest.raises(InputError, match="'gyro' is several columns: IMU/gyro, Rig/gyro; give the whole name"):
        find_column("gyro", COLUMNS, where="f")
    with pytest.raises(InputError, match=r"no column 'IMU/gyr' .* there are IMU/gyro, .*did you mean 'IMU/gyro'\?"):
        find_column("IMU/gyr", COLUMNS, where="f")


def test_a_draft_is_guessed_from_names_and_units():
    columns = [
        Column("Zeit", "ms"), Column("GyroX_deg_s"), Column("Lenkwinkel", "°"), Column("ACC_Y", "g"),
        Column("Batt", "V"),
        Column("YawRate", "N"),
    ]  # fmt: skip
    quantities = {"roll_rate": "angular rate", "steer": "angle", "yaw_rate": "angular rate",
                  "lateral_acceleration": "acceleration"}  # fmt: skip
    assert draft_map(columns, quantities).splitlines() == [
        "[channels]",
        'time = {column = "Zeit"}  # the file states ms',
        'roll_rate = {column = "GyroX_deg_s", unit = "deg_s"}',
        'steer = {column = "Lenkwinkel"}  # the file states °',
        'lateral_acceleration = {column = "ACC_Y"}  # the file states g',
        '# yaw_rate = {column = "?", unit = "rad/s"}',
    ]
    assert "time" not in draft_map(columns, quantities, clock=False)
    assert 'steer = {column = "steer", unit = "?"}' in draft_map([Column("steer")], quantities)
