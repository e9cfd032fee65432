"""Recordings as laboratories have them: own names, awkward units, turned signs and axes, any format, with their map."""

from pathlib import Path

import numpy as np
import tomli_w

from tests.validation.recording_writers import OWN_TIMES, WRITERS, name_in_file

RIG = {  # channel: column, unit, SI value of the unit, sign of the column in ISO axes against adapted SAE
    "slip_angle": ("SR angle", "mrad", 1e-3, -1.0),
    "lateral_force": ("Fy", "lbf", 4.4482216152605, 1.0),
    "vertical_load": ("Fz", "kN", 1e3, 1.0),
    "aligning_moment": ("Mz", "Ncm", 1e-2, -1.0),
    "inclination": ("Gamma", "deg", np.pi / 180, 1.0),
    "speed": ("V", "mph", 0.44704, 1.0),
    "plate_displacement": ("Platte", "inch", 0.0254, 1.0),
    "rim_displacement": ("Felge", "um", 1e-6, 1.0),
}
ISO = {"lateral_force": -1.0, "aligning_moment": -1.0, "plate_displacement": -1.0, "rim_displacement": -1.0}


def write_lab(folder: Path, form: str, recording, stem: str) -> Path:
    """Write a rig recording (SI, adapted SAE) in one format with a sidecar in ISO axes; gives the file."""
    suffix, write = WRITERS[form]
    own_times = form in OWN_TIMES
    columns = {"t": (recording.time, "s") if own_times else (recording.time * 1e3, "ms")}
    channels = {} if own_times else {"time": {"column": name_in_file(form, "t"), "unit": "ms"}}
    for channel, (column, unit, size, sign) in RIG.items():
        values = getattr(recording, channel, None)
        if values is None:
            continue
        column = column.replace(" ", "_") if form in ("mat5", "mat73", "timetable", "tdx") else column
        columns[column] = (values * ISO.get(channel, 1.0) * sign / size, unit)
        channels[channel] = {"column": name_in_file(form, column), "unit": unit, "sign": int(sign)}
    columns["counter"] = (np.arange(len(recording.time), dtype=float), "-")
    path = folder / f"{stem}{suffix}"
    write(path, columns)
    condition = recording.condition
    sidecar = {
        "tyre": condition.tyre, "load_kN": condition.load / 1e3, "pressure_bar": condition.pressure / 1e5,
        "surface": condition.surface, "axes": "ISO", "speed_m_s": condition.speed, "camber_rad": condition.camber,
        "temperature_C": condition.temperature, "rim": condition.rim, "channels": channels,
        "drum_radius_m": condition.drum_radius,
    }  # fmt: skip
    text = tomli_w.dumps({key: value for key, value in sidecar.items() if value is not None})
    (folder / f"{stem}.toml").write_text(text, encoding="utf-8")
    return path


MOTION = {  # channel: column, unit, SI value of the unit, sign of the column
    "roll_rate": ("gyro_x", "deg/s", np.pi / 180, -1.0),
    "pitch_rate": ("gyro_y", "deg/s", np.pi / 180, 1.0),
    "yaw_rate": ("gyro_z", "deg/s", np.pi / 180, 1.0),
    "steer": ("Lenkung", "mrad", 1e-3, -1.0),
}
ORDER, ANGLES = "ZYX", (20.0, -35.0, 10.0)


def turned(order: str, degrees) -> np.ndarray:
    """Rotation by three angles about axes that turn along (capitals), multiplied out by hand."""
    found = np.eye(3)
    for axis, angle in zip(order, np.deg2rad(degrees), strict=True):
        c, s = np.cos(angle), np.sin(angle)
        one = {"X": [[1, 0, 0], [0, c, -s], [0, s, c]], "Y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
               "Z": [[c, -s, 0], [s, c, 0], [0, 0, 1]]}[axis]  # fmt: skip
        found = found @ np.array(one)
    return found


def write_motion(folder: Path, form: str, time: np.ndarray, channels, stem: str = "run") -> tuple[Path, dict]:
    """Write a motion (SI, of the bicycle) as a turned sensor sees it; gives the file and its channel map."""
    suffix, write = WRITERS[form]
    own_times = form in OWN_TIMES
    seen = dict(channels)
    triple = ("roll_rate", "pitch_rate", "yaw_rate")
    sensor = turned(ORDER, ANGLES).T @ np.array([channels[name] for name in triple])
    seen |= dict(zip(triple, sensor, strict=True))
    columns = {"t": (time, "s") if own_times else (time * 1e3, "ms")}
    table = {} if own_times else {"time": {"column": name_in_file(form, "t"), "unit": "ms"}}
    for channel, values in seen.items():
        column, unit, size, sign = MOTION[channel]
        columns[column] = (values * sign / size, unit)
        table[channel] = {"column": name_in_file(form, column), "unit": unit, "sign": int(sign)}
    columns["ignored"] = (np.ones_like(time), "V")
    path = folder / f"{stem}{suffix}"
    write(path, columns)
    mounting = [{"channels": list(triple), "angles_deg": list(ANGLES), "order": ORDER, "sd_deg": 0.5}]
    return path, {"channels": table, "mounting": mounting}
