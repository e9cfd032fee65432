"""A file of sensors that records as it stands, every key explained: ``velotyre new sensors.toml --kind sensors``."""

EXAMPLE = """\
# Sensors of a simulated ride:
# velotyre simulate MODEL --speed 5 --initial lean_rate=0.3 --sensors {file} --noise --out ride
# Written by `velotyre new`. Numbers are in the unit that the channel's name ends in, unless the key says another.

rate_hz = 100                  # samples per second

[channels.roll_rate_rad_s]     # also lean_rad, steer_rad, steer_rate_rad_s, yaw_rate_rad_s, lean_torque_N_m
noise_sd = 0.01                # standard deviation; drawn with --noise only
bandwidth_hz = 20              # corner frequency of the noise, or correlation = 0.3 of neighbouring samples; else white
# scale_error = 0.02           # reads 2 % too much
# offset = 0.005               # at the start
# drift_per_s = 0.001          # growth of the offset
# delay_s = 0.01               # late
# low_pass_hz = 10             # corner frequency of a first-order filter

[channels.steer_rad]
noise_sd = 0.002
resolution = 0.0015            # step of an encoder

[channels.steer_torque_N_m]    # an empty table is a perfect sensor
"""
