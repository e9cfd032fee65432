"""Invented recordings of laboratories, each in the way of another logger; all synthetic."""

from pathlib import Path

import numpy as np


def rig_log(path: Path) -> dict:
    """Flat track: run-in, sweep at 300 N, step and back, sweep at 500 N, wheel lifted; decimal commas, a units row.

    Forces F = D sin(1.3 atan(C a / (1.3 D))) with C = 16 load / rad, lagged by 0.1 m.
    """
    rng, rate = np.random.default_rng(1), 100

    def hold(value, seconds):
        return np.full(int(seconds * rate), float(value))

    corners = np.interp(np.arange(0, 4, 1 / (5 * rate)), [0, 1, 3, 4], [0, 5, -5, 0])  # 20 s
    sweep = np.tile(corners, 2)
    slip = np.concatenate([hold(0, 6), sweep, hold(0, 4), hold(1, 4), hold(0, 7), sweep, hold(0, 5)])
    load = np.concatenate([hold(0, 4), hold(300, 54), hold(500, 45), hold(0, 20)])[: slip.size]
    speed = 2.5
    angle, lagged = np.deg2rad(slip), np.zeros(slip.size)
    for place in range(1, slip.size):
        lagged[place] = lagged[place - 1] + (angle[place - 1] - lagged[place - 1]) * speed / rate / 0.1
    peak = 1.1 * load
    force = np.zeros(slip.size)
    on = load > 0
    force[on] = peak[on] * np.sin(1.3 * np.arctan(16 * load[on] * lagged[on] / (1.3 * peak[on])))
    force += rng.normal(0, 1.5, slip.size)
    rows = ["# Rig 7;somebody", "no;clk;enc_alpha;LC2;LC_FZ;v_belt;T_tyre;note", "-;ms;deg;N;N;km/h;degC;-"]
    loads, slips = load + rng.normal(0, 2, slip.size), slip + rng.normal(0, 0.01, slip.size)
    for k in range(slip.size):
        cells = [f"{k}", f"{10 * k}", f"{slips[k]:.3f}", f"{force[k]:.2f}", f"{loads[k]:.1f}", f"{3.6 * speed:.2f}"]
        rows.append(";".join([*cells, "24.1", "ok" * (k % 50 > 0)]).replace(".", ","))
    path.write_bytes(("\n".join(rows) + "\n").encode("cp1252"))
    second = 6 + 40 + 15
    return {
        "samples": slip.size, "sweeps": [[600, 4600], [second * rate, (second + 40) * rate]],
        "stiffness": {300: 16 * 300.0, 500: 16 * 500.0},
    }  # fmt: skip


def imu_log(path: Path) -> dict:
    """Two kicks in deg/s and g, dates as times, an offset of the gyro."""
    rng, time = np.random.default_rng(2), np.arange(0, 40, 0.04)
    roll, yaw = rng.normal(0, 1, time.size) + 2.0, rng.normal(0, 1, time.size)
    kicks, decay, hertz = (10.0, 25.0), -0.6, 1.1
    for kick in kicks:
        after = np.maximum(time - kick, 0)
        roll += (time >= kick) * 60 * np.exp(decay * after) * np.sin(2 * np.pi * hertz * after)
        yaw += (time >= kick) * 40 * np.exp(decay * after) * np.cos(2 * np.pi * hertz * after + 0.3)
    lines = ["timestamp,acc_y (g),acc_z (g),gyro_x (deg/s),gyro_z (deg/s),wheel_speed (km/h)"]
    for k, moment in enumerate(time):
        stamp = f"2026-03-01T10:00:{moment:06.3f}"
        lines.append(
            f"{stamp},{rng.normal(0, 0.02):.4f},{rng.normal(1, 0.02):.4f},{roll[k]:.3f},{yaw[k]:.3f},18.0{k % 5}"
        )
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return {"kicks": kicks, "decay": decay, "hertz": hertz}


def pull_export(path: Path) -> float:
    """A testing machine with a long header, tabs, decimal commas, Windows-1252; gives the stiffness, N/m."""
    rng = np.random.default_rng(3)
    way = np.tile(np.interp(np.arange(400), [0, 200, 400], [0, 4, 0]), 2)  # mm
    force = 62 * way + np.where(np.diff(way, append=0) > 0, 4, -4) + rng.normal(0, 0.6, way.size)
    head = ["Prüfer:\tMüller", "Vorkraft:\t5\tN", "", "Ergebnisse:", "\tFmax\tWeg", "\tN\tmm", "\t252,1\t4,0", ""]
    rows = [f"{0.1 * k:.1f}\t{force[k]:.2f}\t{way[k]:.3f}".replace(".", ",") for k in range(way.size)]
    path.write_bytes("\n".join([*head, "Prüfzeit\tStandardkraft\tStandardweg", "s\tN\tmm", *rows, ""]).encode("cp1252"))
    return 62e3


def half_empty(folder: Path) -> Path:
    """Two loggers merged: every second cell empty, a hole of a second, a dead and an empty column."""
    lines = ["Time,Roll Angle [deg],Yaw rate [rad/s],Steer Torque [Nm],GPS speed [km/h],dead,empty"]
    for k in range(1500):
        t = k / 100
        lean = "" if 500 < k < 600 else f"{5 * np.sin(t):.4f}"
        yaw = f"{0.2 * np.cos(t):.4f}" if k % 2 == 0 else ""
        lines.append(f"{t:.2f},{lean},{yaw},{np.sin(3 * t):.4f},{18 if k % 100 == 0 else ''},0,")
    path = folder / "half.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def can_log(folder: Path) -> Path:
    """A measurement file with two groups of different rates and a state that is no motion."""
    from asammdf import MDF, Signal

    rng = np.random.default_rng(4)
    fast, slow = np.arange(0, 5, 0.01), np.arange(0.003, 5, 0.02)
    path = folder / "can.mf4"
    with MDF(version="4.10") as file:
        torque = 3 * np.exp(-(((fast - 3) / 0.2) ** 2)) + rng.normal(0, 0.05, fast.size)
        rate = np.gradient(torque) + rng.normal(0, 0.01, fast.size)
        file.append([Signal(torque, fast, unit="Nm", name="SteerTrq_Act"),
                     Signal(rate, fast, unit="rad/s", name="SteerRate")], common_timebase=True)  # fmt: skip
        file.append([Signal(20 * np.sin(slow), slow, unit="°/s", name="IMU_RollRate"),
                     Signal(np.full(slow.size, 7.0), slow, unit="m/s", name="VehSpd"),
                     Signal(np.round(slow) % 4, slow, unit="", name="GearState")], common_timebase=True)  # fmt: skip
        file.save(path, overwrite=True)
    return path
