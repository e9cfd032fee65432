"""A modal table may be headed as people head them; roots are those of its SI columns."""

import numpy as np
import pytest

from studies.diagnosis import read_measurement
from tests.shared.refusals import refuses

SPEED = np.array([4.6, 5.4, 6.2])
ROOT = np.array([-0.31 + 4.1j, -0.77 + 4.5j, -1.6 + 4.9j])  # 1/s
SD = np.array([0.02, 0.03])


@pytest.fixture
def points(tmp_path):
    def at(head, *columns, effects=""):
        rows = [
            ",".join(
                [head],
            ),
            *(",".join(["weave", *(f"{x:.12g}" for x in row)]) for row in zip(*columns, strict=True)),
        ]
        (tmp_path / "t.csv").write_text("\n".join([*rows, ""]))
        (tmp_path / "m.toml").write_text(f'kind = "modal"\nbicycle = "benchmark"\n{effects}[modal]\ntable = "t.csv"\n')
        return read_measurement(tmp_path / "m.toml")

    return at


RATIO, NATURAL = -ROOT.real / abs(ROOT), abs(ROOT)
HERTZ = 2 * np.pi
COLUMNS = {
    "mode,speed [m/s],real [1/s],imag [rad/s]": (SPEED, ROOT.real, ROOT.imag),
    "mode,speed_km_h,real_1_s,imag_rad_s": (3.6 * SPEED, ROOT.real, ROOT.imag),
    "Mode,Speed (km/h),Frequency [Hz],Damping ratio": (3.6 * SPEED, ROOT.imag / HERTZ, RATIO),
    "mode,v [m/s],frequency_Hz,damping_ratio": (SPEED, ROOT.imag / HERTZ, RATIO),
    "mode,speed_m_s,frequency [Hz],damping_ratio [%]": (SPEED, ROOT.imag / HERTZ, 100 * RATIO),
    "mode,speed [m/s],natural_frequency [Hz],zeta [-]": (SPEED, NATURAL / HERTZ, RATIO),
    "mode,speed [m/s],imag_rad_s,zeta": (SPEED, ROOT.imag, RATIO),
    "mode,speed [m/s],real_1_s,frequency [1/min]": (SPEED, ROOT.real, 60 * ROOT.imag / HERTZ),
}  # fmt: skip


@pytest.mark.parametrize("head", COLUMNS)
def test_the_same_roots_are_read_from_every_heading(points, head):
    found = points(head, *COLUMNS[head]).points
    np.testing.assert_allclose([p.speed for p in found], SPEED, rtol=1e-10)
    np.testing.assert_allclose([p.eigenvalue for p in found], ROOT, rtol=1e-9)


@pytest.mark.parametrize("frequency", ["frequency", "natural_frequency"])
def test_the_sd_of_frequency_and_ratio_are_carried_to_the_parts_of_the_root(points, frequency):
    """Against the scatter of many samples."""
    value = (ROOT.imag if frequency == "frequency" else NATURAL) / HERTZ
    sds = np.full(3, 0.004), np.full(3, 0.006)  # Hz, of the ratio
    head = f"mode,speed [m/s],{frequency} [Hz],{frequency}_sd [Hz],damping_ratio,damping_ratio_sd"
    found = points(head, SPEED, value, sds[0], RATIO, sds[1]).points
    rng = np.random.default_rng(5)
    f, z = (
        x[:, None] + sd[:, None] * rng.standard_normal((3, 40_000)) for x, sd in zip((value, RATIO), sds, strict=True)
    )
    along = np.sqrt(1 - z**2)
    natural = HERTZ * f / (along if frequency == "frequency" else 1)
    parts = np.stack([(-z * natural).std(1), (along * natural).std(1)], 1)
    np.testing.assert_allclose([p.sd for p in found], parts, rtol=0.02)


def test_what_a_frequency_is_taken_as_is_told(points):
    told = points("mode,speed [m/s],frequency_Hz,zeta", SPEED, ROOT.imag / HERTZ, RATIO).notes
    assert any(note.startswith("frequency_Hz: taken as the frequency of the oscillation") for note in told)


def test_a_setting_of_a_row_has_its_unit_in_brackets(points):
    effects = "[effects.steer_damper]\ndamping = 1.0\n"
    head = "mode,speed [m/s],real [1/s],imag [rad/s],steer_damper.damping [N m s/deg]"
    found = points(head, SPEED, ROOT.real, ROOT.imag, np.deg2rad(np.array([1.0, 2.0, 3.0])), effects=effects).points
    np.testing.assert_allclose([dict(p.settings)["steer_damper.damping"] for p in found], [1, 2, 3], rtol=1e-9)


@pytest.mark.parametrize(("head", "columns", "words"), [
    ("mode,speed,real [1/s]", (SPEED, ROOT.real), "column 'speed': no unit; write one of m/s, km/h"),
    ("mode,speed [furlong],real [1/s]", (SPEED, ROOT.real), "unit 'furlong' is not one of m/s"),
    ("mode,speed [m/s],zeta", (SPEED, RATIO), "zeta needs a column frequency or natural_frequency"),
    ("mode,speed [m/s],natural_frequency [Hz]", (SPEED, NATURAL), "needs a column damping_ratio"),
    ("mode,speed [m/s],frequency [Hz],zeta", (SPEED, NATURAL, 17 + RATIO), "must lie between -1 and 1"),
    ("mode,speed [m/s],frequency [Hz],zeta", (SPEED, 0 * NATURAL, RATIO), "with a frequency above 0"),
    ("mode,speed [m/s],frequency [Hz],imag [rad/s]", (SPEED, NATURAL, NATURAL), "give the same; keep one"),
    ("mode,speed [m/s],real_1_s,frequency [Hz],zeta", (SPEED, ROOT.real, NATURAL, RATIO), "give the same; keep one"),
    ("mode,speed [m/s],speed_m_s,real_1_s", (SPEED, SPEED, ROOT.real), "give the same; keep one"),
    ("mode,speed [km/h],real [1/s]", (1e4 * SPEED, ROOT.real), r"line 2: .*speed \[km/h\]"),
    ("mode,frequency [Hz]", (NATURAL,), "the column speed_m_s is missing"),
    ("mode,speed [m/s],frequency [Hz],blah", (SPEED, NATURAL, NATURAL), "blah"),
])  # fmt: skip
def test_headings_that_are_refused(points, head, columns, words):
    refuses(words, points, head, *columns)


def test_a_ratio_is_read_from_its_two_parts_and_its_sd(points):
    real, imag, sd = np.array([0.4, 0.5, 0.6]), np.array([-0.1, 0.2, 0.3]), np.full(3, 0.02)
    head = "mode,speed [m/s],real [1/s],imag [rad/s],steer_over_lean_re,steer_over_lean_im,steer_over_lean_sd"
    measured = points(head, SPEED, ROOT.real, ROOT.imag, real, imag, sd).points
    assert [p.ratios for p in measured] == [
        {"steer_over_lean": (complex(re, im), 0.02)} for re, im in zip(real, imag, strict=True)
    ]


@pytest.mark.parametrize("part", ["re", "im", "sd"])
def test_a_part_of_a_ratio_alone_is_refused(points, part):
    head = f"mode,speed [m/s],real [1/s],imag [rad/s],yaw_over_lean_{part}"
    words = "a ratio needs both columns yaw_over_lean_re and yaw_over_lean_im"
    refuses(words, points, head, SPEED, ROOT.real, ROOT.imag, np.full(3, 0.5))
