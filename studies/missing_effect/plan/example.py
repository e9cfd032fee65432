"""A file of costs that plans as it stands, every key explained: ``velotyre new costs.toml --kind costs``."""

EXAMPLE = """\
# What can be measured next, and its price: velotyre plan MEASUREMENT --costs {file} --out plan
# Written by `velotyre new`. Prices in any currency, or hours; everything else in SI.

currency = "EUR"
# budget = 1000                # no plan above it
# most_runs = 40               # in all

[[runs]]                       # runs as those of the measurement, at these speeds; may be repeated for dearer ones
speeds_m_s = [4, 5, 6, 7]
setup = 50                     # once for each speed that is ridden
each = 10                      # each run
most = 6                       # runs at one speed

[[runs]]                       # these need the runway
speeds_m_s = [8, 10]
setup = 200
each = 20

# [channels.steer_over_lean]   # of modes: steer_over_lean, yaw_over_lean; of histories: steer_rad, yaw_rate_rad_s, ...
# price = 300                  # once; what is recorded already costs nothing

# [bench.steer_damper]         # a test of the size of an effect by itself, or of a parameter of the bicycle
# price = 400
# sd = 0.1                     # of the test, SI; of a parameter of the bicycle it is needed

# [sd]                         # of one run, where it is not that of the measurement
# real_1_s = 0.05              # modes: real_1_s, imag_rad_s, steer_over_lean, yaw_over_lean
# imag_rad_s = 0.05

# [limits]                     # the size of an effect above which it would matter: its 95 % limit is to go below
# steer_damper = 0.2           # EFFECT or EFFECT.PARAMETER

[goal]
odds = 20                      # for what is true
probability = 0.9              # that they are reached
"""
