"""Measured frequency responses: of the published benchmark bicycle, by nothing of velotyre (synthetic)."""

from dataclasses import replace

import numpy as np
import pytest
from published_bicycle import gains
from read_report import read_report
from small_library import all_but, among

from bicycle import Model, load_bicycle
from bicycle.effects import registry
from bicycle.motion import frequency_response
from studies.cli import main
from studies.diagnosis import FrequencyResponses, diagnose, fit_residual, read_measurement
from tyre.ground import InputError

HEAD = "input,output,frequency_Hz,speed_m_s,re,im,sd"
TOML = 'kind = "frequency_response"\nbicycle = "benchmark"\n[uncertainty]\nlam = 0.005\nIBxx = 0.2\n'
TABLE = '[frequency_response]\ntable = "r.csv"\n'
HERTZ = np.geomspace(0.4, 4.0, 9)
SPEEDS = (4.0, 7.0)
RIVALS = ("steer_spring", "steer_damper", "pneumatic_trail", "crown_radius", "steer_scale", "steer_torque_scale")
FEW = tuple(name for name in registry() if name not in ("no_slip", "steer_damper"))


def rows(
    outputs=("roll_rate", "steer"), speeds=SPEEDS, *, noise=0.03, seed=3, source="steer_torque", sensed=None, **hidden
):
    """Lines of a table; ``sensed`` multiplies an output by a function of i omega."""
    rng, found = np.random.default_rng(seed), []
    for v in speeds:
        true = gains(v, HERTZ, source, **hidden)
        for name in outputs:
            gain = true[name] * (sensed or {}).get(name, lambda s: 1.0)(2j * np.pi * HERTZ)
            sd = noise * (np.abs(gain) + 0.1 * np.abs(gain).max())
            noisy = gain + sd * (rng.standard_normal(len(gain)) + 1j * rng.standard_normal(len(gain)))
            found += [
                f"{source},{name},{f:.9g},{v},{h.real:.9g},{h.imag:.9g},{s:.9g}"
                for f, h, s in zip(HERTZ, noisy, sd, strict=True)
            ]
    return found


def write(folder, lines, *, head=HEAD, toml=TOML + TABLE):
    (folder / "r.csv").write_text("\n".join([head, *lines]) + "\n")
    (folder / "m.toml").write_text(toml)
    return folder / "m.toml"


def chosen(forward, *names):
    return tuple(c for c in forward.candidates if c.identifier in names)


@pytest.mark.parametrize("source", ["steer_torque", "lean_torque"])
def test_responses_are_those_of_the_published_matrices(tmp_path, source):
    outputs = ("lean", "roll_rate", "steer", "steer_rate", "yaw_rate")
    lines = rows(outputs, source=source, noise=1e-5)
    forward = read_measurement(write(tmp_path, lines)).prepare()
    residual, none = forward.residual((), forward.nominal, slopes=False)
    assert none.shape == (len(residual), 0)
    assert len(residual) == 2 * len(lines)
    assert np.sqrt(np.mean(residual**2)) == pytest.approx(1, abs=0.15)  # at a noise of 1e-5
    spring = chosen(
        read_measurement(write(tmp_path, rows(outputs, source=source, noise=1e-5, spring=3.0))).prepare(),
        "steer_spring",
    )
    hidden = read_measurement(tmp_path / "m.toml").prepare()
    there, _ = hidden.residual(spring, np.array([*hidden.nominal, 3.0]))
    assert np.sqrt(np.mean(there**2)) == pytest.approx(1, abs=0.15)


def test_a_lateral_force_and_tyres_are_those_of_the_responses_of_the_linear_model(tmp_path):
    """The other road to the same numbers: state matrices of the model instead of a descriptor system."""
    toml = TOML.replace(
        "[uncertainty]",
        "[effects.relaxation_length]\ncornering_stiffness = 9000\nrelaxation_length = 0.1\n[uncertainty]",
    )
    model = read_measurement(write(tmp_path, rows(), toml=toml + TABLE)).model
    lines = []
    for v in SPEEDS:
        found = frequency_response(model, speed=v, input="lateral_push", frequency_hz=HERTZ).outputs["yaw_rate"]
        lines += [
            f"lateral_push,yaw_rate,{f:.12g},{v},{h.real:.12g},{h.imag:.12g},{1e-5 * abs(h):.6g}"
            for f, h in zip(HERTZ, found, strict=True)
        ]
    forward = read_measurement(write(tmp_path, lines, toml=toml + TABLE)).prepare()
    assert np.abs(forward.residual((), forward.nominal)[0]).max() < 1e-3


def test_slopes_are_the_differences_of_the_residual(tmp_path):
    toml = TOML + TABLE + "[frequency_response.accelerometer]\nx_m = 0.4\nz_m = -0.8\n"
    lines = [*rows(), *rows(("yaw_rate",), source="lean_torque"),
             *(f"steer_torque,lateral_acceleration,{f},{v},0.1,0.2,0.1" for f in (0.7, 2) for v in SPEEDS)]  # fmt: skip
    forward = read_measurement(write(tmp_path, lines, toml=toml)).prepare()
    names = ("steer_damper", "steer_torque_scale", "roll_rate_delay", "steer_lowpass", "steer_scale", "speed_scale",
             "speed_offset")  # fmt: skip
    candidates = chosen(forward, *names)
    assert len(candidates) == len(names)
    sizes = {"steer_damper": 0.8, "roll_rate_delay": 0.01, "steer_lowpass": 0.02, "speed_offset": 0.1}
    theta = np.array([*forward.nominal, *(sizes.get(c.identifier, 0.05) for c in candidates)])
    _, slope = forward.residual(candidates, theta)
    for column, u in enumerate((*forward.nuisances, *(u for c in candidates for u in c.unknowns))):
        step = 1e-4 * u.scale
        up, down = (
            forward.residual(candidates, theta + sign * step * (np.arange(len(theta)) == column))[0] for sign in (1, -1)
        )
        expected = (up - down) / (2 * step)
        np.testing.assert_allclose(slope[:, column], expected, rtol=1e-3, atol=1e-4 * np.abs(expected).max() + 1e-9)


def test_an_accelerometer_reads_the_motion_of_its_place_and_a_share_of_gravity(tmp_path):
    """dV/dt + v r + x dr/dt - z d2(lean)/dt2 - g lean, by hand, with V = 0 where nothing slips."""
    x, z, lines = 0.4, -0.8, []
    for v in SPEEDS:
        motion, s = gains(v, HERTZ), 2j * np.pi * HERTZ
        read = (v + x * s) * motion["yaw_rate"] - (z * s**2 + 9.81) * motion["lean"]
        lines += [
            f"steer_torque,lateral_acceleration,{f:.12g},{v},{h.real:.12g},{h.imag:.12g},{1e-5 * abs(h):.6g}"
            for f, h in zip(HERTZ, read, strict=True)
        ]
    toml = TOML + TABLE + f"[frequency_response.accelerometer]\nx_m = {x}\nz_m = {z}\n"
    measurement = read_measurement(write(tmp_path, lines, toml=toml))
    forward = measurement.prepare()
    assert np.abs(forward.residual((), forward.nominal)[0]).max() < 1e-2
    assert any("- g lean" in note for note in forward.notes)
    g = 9.80665
    in_g = replace(forward, points=tuple(replace(p, value=p.value / g, sd=p.sd / g) for p in forward.points))
    right = dict(in_g.misreadings())["lateral acceleration in g"]
    assert np.abs(right.residual((), right.nominal)[0]).max() < 1e-2


@pytest.mark.parametrize(
    ("name", "size", "sensed"),
    [
        ("steer_scale", np.log(1.08), {"steer": lambda s: 1.08}),
        ("steer_delay", 0.02, {"steer": lambda s: np.exp(-0.02 * s)}),
        ("roll_rate_lowpass", 0.03, {"roll_rate": lambda s: 1 / (1 + 0.03 * s)}),
        ("steer_torque_scale", np.log(1.1), dict.fromkeys(("steer", "roll_rate"), lambda s: 1.1)),
        ("steer_torque_delay", 0.015, dict.fromkeys(("steer", "roll_rate"), lambda s: np.exp(-0.015 * s))),
    ],
)
def test_errors_of_sensors_do_what_they_are_called_after(tmp_path, name, size, sensed):
    forward = read_measurement(write(tmp_path, rows(noise=1e-5, sensed=sensed))).prepare()
    residual, _ = forward.residual(chosen(forward, name), np.array([*forward.nominal, size]))
    assert np.sqrt(np.mean(residual**2)) == pytest.approx(1, abs=0.2)


def test_gain_and_phase_in_other_units_are_the_same_numbers(tmp_path):
    plain = read_measurement(write(tmp_path, rows(noise=0.02))).points
    lines, decibels = [], []
    for p in plain:
        output = {"lean_rate": "roll_rate"}.get(p.output, p.output)
        unit = "deg/s" if output == "roll_rate" else "mrad"
        factor = 180 / np.pi * 1e-3 if output == "roll_rate" else 1.0  # per N mm: a thousandth of a degree, of a mrad
        lines.append(f"{p.input},{output},{unit},N mm,{2 * np.pi * p.frequency:.12g},{3.6 * p.speed:.12g},"
                     f"{abs(p.value) * factor:.12g},{np.angle(p.value):.12g},{p.sd * factor:.12g}")  # fmt: skip
        share = p.sd / abs(p.value) * 20 / np.log(10)
        db, degrees = 20 * np.log10(abs(p.value)), np.degrees(np.angle(p.value))
        decibels.append(f"{p.input},{output},{p.frequency:.12g},{p.speed},{db:.12g},{degrees:.12g},{share:.12g}")
    head = "input,output,output_unit,input_unit,frequency_rad_s,speed_km_h,gain,phase_rad,sd"
    for found in (
        read_measurement(write(tmp_path, lines, head=head)).points,
        read_measurement(
            write(tmp_path, decibels, head="input,output,frequency_hz,speed_m_s,gain_db,phase_deg,sd_db")
        ).points,
    ):
        np.testing.assert_allclose([p.value for p in found], [p.value for p in plain], rtol=1e-9)
        np.testing.assert_allclose([p.sd for p in found], [p.sd for p in plain], rtol=1e-9)
        np.testing.assert_allclose(
            [(p.speed, p.frequency) for p in found], [(p.speed, p.frequency) for p in plain], rtol=1e-9
        )


def test_noise_from_coherence_holds_the_truth(tmp_path):
    """Eight independent averages of a known gain with white noise: squares of errors over sd are one on average."""
    rng, true, n, count = np.random.default_rng(1), 0.3 - 0.2j, 8, 4000
    u, e = rng.standard_normal((2, count, n, 2)) @ [1, 1j]
    y = true * u + 0.2 * e
    cross, uu, yy = (u.conj() * y).sum(1), (np.abs(u) ** 2).sum(1), (np.abs(y) ** 2).sum(1)
    gain, coherence = cross / uu, np.abs(cross) ** 2 / uu / yy
    lines = [
        f"steer_torque,steer,1,{1 + 50 * k / count:.9g},{g.real:.9g},{g.imag:.9g},{c:.12g},{n}"
        for k, (g, c) in enumerate(zip(gain, coherence, strict=True))
    ]
    head = "input,output,frequency_Hz,speed_m_s,re,im,coherence,averages"
    points = read_measurement(write(tmp_path, lines, head=head)).points
    errors = np.array([(p.value - true) / p.sd for p in points])
    assert np.mean(np.abs(errors) ** 2) / 2 == pytest.approx(1, abs=0.08)
    assert np.mean(np.abs(errors.real) < 1.96) == pytest.approx(0.95, abs=0.025)
    plain = np.abs(gain) * np.sqrt((1 - coherence) / coherence / (2 * n))  # Bendat & Piersol, Random Data, ch. 9
    np.testing.assert_allclose([p.sd for p in points], plain * np.sqrt(n / (n - 2)), rtol=1e-6)


def test_a_spring_is_found_and_named(tmp_path, capsys, no_pictures):
    """At 4 m/s the bicycle is unstable and something held it; 3 % noise; 3 N m/rad are hidden."""
    file, out = write(tmp_path, rows(speeds=(4.0, 5.5, 7.0), spring=3.0)), tmp_path / "out"
    left_out = [f"--without={name}" for name in all_but(read_measurement(file), RIVALS)]
    main(["diagnose", str(file), "--out", str(out), "--no-stability", *left_out])
    said = capsys.readouterr()
    assert "named. Missing effect: elastic torque on the steering (steer_spring: stiffness" in said.out
    assert (out / "before_after.png").exists()
    report = read_report(out)
    assert "unstable at 4, 7 m/s: something held the bicycle there" in report
    assert "Gain and phase, measured with 95 % intervals" in report
    assert "to 7 m/s |" not in report  # no thirds of the frequencies called speeds


def test_a_gap_that_nobody_names_is_kept_as_a_torque_against_the_steer_rate(tmp_path):
    """3 N m s/rad are hidden and no effect is tried: the gap is kept, as that of modes."""
    measurement = read_measurement(write(tmp_path, rows(speeds=(5.0, 6.0, 7.0, 8.0), damper=3.0)))
    found = among(measurement, ("speed_scale",))
    assert found.verdict.verdict in ("unknown", "partial")
    kept = fit_residual(found)
    value, sd = kept.values["steer_from_steer_rate"], kept.sd["steer_from_steer_rate"]
    assert abs(value + 3.0) < 3 * sd < 1.5


def test_nothing_hidden_names_nothing(tmp_path):
    assert diagnose(read_measurement(write(tmp_path, rows(noise=0.1, seed=8)))).verdict.verdict == "none"


def test_what_is_held_out_and_what_cannot_be_told(tmp_path):
    forward = read_measurement(write(tmp_path, rows())).prepare()
    speeds = np.repeat([p.speed for p in forward.points], 2)
    assert [set(speeds[forward.rows.fold == k]) for k in (0, 1)] == [{4.0}, {7.0}]
    assert forward.varied
    assert "steer_friction" in forward.refused
    one = read_measurement(write(tmp_path, rows(("steer",), speeds=(5.0,)))).prepare()
    assert not one.varied
    assert len(set(one.rows.fold)) == 6  # bands of frequency
    assert "looks the same: see steer_scale" in one.refused["steer_torque_scale"]
    assert "speed_offset" in one.refused
    two = read_measurement(
        write(tmp_path, [*rows(speeds=(5.0,)), *rows(speeds=(5.0,), source="lean_torque")])
    ).prepare()
    assert two.varied
    assert len(set(two.rows.fold)) == 2  # inputs


def test_further_measurements_are_predicted(tmp_path):
    forward = read_measurement(write(tmp_path, rows())).prepare()
    proposed = {p.what: p for p in forward.propose_measurements()}
    assert "the response of the yaw rate to the steer torque at the measured speeds" in proposed
    assert "the response to a lateral push at the measured speeds" in proposed
    damper = chosen(forward, "steer_damper")
    for proposal in proposed.values():
        value, slope = proposal.predict_white(damper, np.array([*forward.nominal, 0.5]))
        assert value.shape == proposal.sd.shape
        assert slope.shape == (len(value), len(forward.nuisances) + 1)
        assert np.abs(slope[:, -1]).max() > 0


def test_a_motor_of_the_base_model_has_no_share_in_the_response_to_the_recorded_torque(tmp_path):
    motor = "[effects.steer_assist]\ngain = 8.0\nfade_speed = 5.0\n[uncertainty]"
    with_motor = TOML.replace("[uncertainty]", motor) + TABLE
    measurement = read_measurement(write(tmp_path, rows(), toml=with_motor))
    assert [e.identifier for e in measurement.model.effects] == ["no_slip"]
    assert any("steer_assist: removed from the base model" in note for note in measurement.notes)
    other = read_measurement(write(tmp_path, rows(source="lean_torque"), toml=with_motor))
    assert [e.identifier for e in other.model.effects] == ["no_slip", "steer_assist"]


def test_the_table_of_a_simulation_is_read(no_pictures, tmp_path):
    main(["simulate", "benchmark", "--speed=6", "--frequency-response=steer_torque", f"--out={tmp_path / 'sim'}"])
    toml = TOML + '[frequency_response]\ntable = "sim/frequency_response.csv"\nspeed_m_s = 6\nrelative_sd = 0.02\n'
    measurement = read_measurement(write(tmp_path, rows(), toml=toml))
    assert {p.output for p in measurement.points} == {"lean", "lean_rate", "steer", "steer_rate", "yaw_rate"}
    true = gains(6.0, [p.frequency for p in measurement.points if p.output == "steer"])["steer"]
    np.testing.assert_allclose([p.value for p in measurement.points if p.output == "steer"], true, rtol=1e-6)
    assert any("not compared: rear_lateral_velocity_m_s_per_steer_torque_N_m" in n for n in measurement.notes)
    for key in ("speed_m_s", "relative_sd"):
        bad = "\n".join(line for line in toml.splitlines() if not line.startswith(key)) + "\n"
        with pytest.raises(InputError, match=f"which does not hold it: write {key} = "):
            read_measurement(write(tmp_path, rows(), toml=bad))
    text = (tmp_path / "sim" / "frequency_response.csv").read_text()
    (tmp_path / "sim" / "frequency_response.csv").write_text(text.replace("steer_torque_N_m", "rear_slip_rad"))
    with pytest.raises(InputError, match="a response to rear_slip_rad is not compared; known: steer_torque_N_m"):
        read_measurement(write(tmp_path, rows(), toml=toml))
    lines = [line.split(",")[0] + "," + line.split(",")[-2] for line in text.splitlines()]
    (tmp_path / "sim" / "frequency_response.csv").write_text(
        "\n".join(["frequency_Hz,x_per_steer_torque_N_m", *lines[1:]]) + "\n"
    )
    with pytest.raises(InputError, match="no output that is compared; known: lean_rad"):
        read_measurement(write(tmp_path, rows(), toml=toml))


GOOD = [f"steer_torque,steer,{hertz},{speed},0.1,0.2,0.01" for hertz, speed in ((1, 5), (2, 5), (1, 6))]
PHASE = "input,output,frequency_Hz,speed_m_s,gain,phase_deg,sd"
NOISY = "input,output,frequency_Hz,speed_m_s,re,im,coherence,averages"


@pytest.mark.parametrize(
    ("head", "lines", "words"),
    [
        (HEAD, [GOOD[0].replace("torque", "tork"), *GOOD[1:]], "line 2: unknown input 'steer_tork'; did you mean"),
        (HEAD, [GOOD[0].replace(",steer,", ",stear,"), *GOOD[1:]], "line 2: unknown output 'stear'; did you mean"),
        (HEAD, [*GOOD, GOOD[0]], "line 5: the same response as line 2; keep one"),
        (HEAD, GOOD[:2], r"2 row\(s\) cannot be diagnosed; give at least 3"),
        (
            HEAD,
            [*GOOD, "steer_torque,steer,1,70,1,1,1"],
            "line 5: speed_m_s = 70 is outside 0 .. 60 m/s; is it in km/h",
        ),
        (
            HEAD,
            [*GOOD, "steer_torque,steer,150,7,1,1,1"],
            "line 5: frequency_Hz = 150 is .* 0 .. 100 Hz; is it in rad/s",
        ),
        (HEAD, [*GOOD, "steer_torque,steer,1,7,1,1,0"], "line 5: sd = 0 must be above 0"),
        (HEAD, [*GOOD, "steer_torque,steer,1,7,1,1,1e-7"], "line 5: the sd is 1e-07; it must be above a millionth"),
        (HEAD, [*GOOD, "steer_torque,steer,1,7,1,1,1e308"], r"line 5: sd = 1e\+308 must be above 0, 1e\+12 or less"),
        (HEAD, [*GOOD, "steer_torque,lateral_acceleration,1,7,1,1,1"], "needs the place of its sensor"),
        (HEAD.replace(",im", ",phase_deg"), GOOD, "give both re and im, and no phase"),
        (HEAD.replace("re,im", "gain,im"), GOOD, "re and im and gain and phase_deg say the same; keep one"),
        (HEAD.replace("re,im", "gain,gain_db"), GOOD, "gain and phase_deg and gain_db and phase_deg say the same"),
        (HEAD.replace("re,im", "phase_deg,phase_rad"), GOOD, "no gain; give re and im, or gain and phase_deg"),
        (PHASE.replace("phase_deg", "coherence"), GOOD, "gain needs one column phase_deg or phase_rad"),
        (PHASE, [GOOD[0].replace("0.1", "-0.1"), *GOOD[1:]], "line 2: gain = -0.1 must not be negative; put the sign"),
        (HEAD.replace("speed_m_s", "frequency_rad_s"), GOOD, "frequency_Hz and frequency_rad_s say the same"),
        (HEAD.replace("frequency_Hz", "speed_km_h"), GOOD, "the column frequency_Hz is missing"),
        (HEAD.replace("speed_m_s", "averages"), GOOD, "the column speed_m_s is missing"),
        (HEAD.replace("sd", "sd_db"), GOOD, "sd_db belongs to gain_db"),
        (HEAD.replace("sd", "coherence"), GOOD, "no noise; give the column sd .* or coherence and averages"),
        (HEAD.replace("frequency", "frequncy"), GOOD, "unknown column 'frequncy_Hz'; did you mean 'frequency_Hz'"),
        (NOISY, [g.replace("0.01", "1,9") for g in GOOD], "line 2: coherence = 1, averages = 9; .* between 0 and 1"),
        (NOISY, [g.replace("0.01", "1.2,9") for g in GOOD], "line 2: coherence = 1.2, .* between 0 and 1"),
        (NOISY, [f"{line},3" for line in GOOD], "line 2: .*averages = 3; .* 4 averages or more"),
        (HEAD + ",output_unit", [f"{line},N" for line in GOOD], "line 2: output_unit: unit 'N' is not a unit of angle"),
        (HEAD + ",input_unit", [f"{g},deg" for g in GOOD], "line 2: input_unit: unit 'deg' is not a unit of moment"),
    ],
)
def test_tables_that_cannot_be_read(tmp_path, head, lines, words):
    with pytest.raises(InputError, match=words):
        read_measurement(write(tmp_path, lines, head=head))


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("speed_m_s = 5\n", "speed_m_s is a column of .*r.csv; take the key out"),
        ("speed_m_s = 500\n", "speed_m_s = 500 is outside 0 .. 60 m/s"),
        ("relative_sd = 0.1\n", "relative_sd, but .*r.csv has sd; keep one"),
        ("relative_sd = 3\n", "relative_sd = 3 must be a share above 0, at most 1"),
        ("accelerometer = {x_m = 0.5, z_m = -0.5}\n", "is not a column; take .frequency_response.accelerometer. out"),
        ("accelerometer = {x_m = 0.5, z_m = 0.5}\n", "z_m = 0.5 must be a finite number in m, z down"),
        ("accelerometer = {z_m = -0.5}\n", "no x_m; give the place of the sensor"),
        ("accelerometer = {x_m = -0.5}\n", "no z_m; give the place of the sensor"),
        ("tabel = 3\n", "unknown key 'tabel'; did you mean 'table'"),
    ],
)
def test_keys_that_are_not_allowed(tmp_path, more, words):
    with pytest.raises(InputError, match=words):
        read_measurement(write(tmp_path, GOOD, toml=TOML + TABLE + more))


def test_one_speed_and_one_share_of_noise_may_stand_in_the_file(tmp_path):
    lines = [line.rpartition(",")[0].replace(",5,", ",").replace(",6,", ",") for line in GOOD[:2]] + [
        "steer_torque,steer,3,0.1,0.3"
    ]
    toml = TOML + TABLE + "speed_m_s = 5\nrelative_sd = 0.1\n"
    points = read_measurement(write(tmp_path, lines, head="input,output,frequency_Hz,re,im", toml=toml)).points
    assert {p.speed for p in points} == {5.0}
    np.testing.assert_allclose([p.sd for p in points], [0.1 * abs(p.value) for p in points])


def test_another_bicycle_with_faint_data_is_drawn(tmp_path):
    """Gains far below their noise: the phase is not known, the gain's interval reaches down to zero."""
    rng, lines, model = np.random.default_rng(4), [], Model(load_bicycle("pista"))
    for v in SPEEDS:
        found = frequency_response(model, speed=v, input="steer_torque", frequency_hz=HERTZ).outputs["steer"]
        noise = 3 * np.abs(found) * (rng.standard_normal(len(HERTZ)) + 1j * rng.standard_normal(len(HERTZ)))
        for f, h, sd in zip(HERTZ, found + noise, 3 * np.abs(found), strict=True):
            lines.append(f"steer_torque,steer,{f:.12g},{v},{h.real:.12g},{h.imag:.12g},{sd:.6g}")
    toml = TOML.replace("benchmark", "pista").replace("lam = 0.005\nIBxx = 0.2\n", "") + TABLE
    found = diagnose(read_measurement(write(tmp_path, lines, toml=toml)), without=FEW)
    assert isinstance(found.kind, FrequencyResponses)
    assert found.verdict.verdict == "none"
    draw, _ = found.kind.figures()["before_after"]
    assert draw(found, tmp_path / "bode")
