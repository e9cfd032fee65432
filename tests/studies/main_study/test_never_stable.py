"""Where no speed is stable no crossing may tell of it; the report says so all the same."""

import pytest
from small_study import RACING, chosen, small

from studies.main_study.report_tables import never_stable
from studies.main_study.settings import Arms
from studies.main_study.solve import solve


@pytest.mark.parametrize(("world", "never"), [(2, False), (3, True)])
def test_stiff_arms_leave_no_speed_that_is_stable(world, never):
    """Self-stable between weave and capsize, until arms of 10 N m/rad end that (Doria & Tognazzo 2014, abstract)."""
    settings = small(RACING, arms=Arms(inertia=0.0, stiffness=10.0, damping=0.0))
    (case,) = chosen(settings, {"Tyre1 flat": (5.5,)}).found
    result = solve(settings, case, settings.setups[world])
    assert never_stable(result, settings.fastest) is never
    by_kind = {(c.mode, c.direction): c.speed for c in result.crossings}
    if not never:  # between the two critical speeds that bound it
        middle = (by_kind["weave", "stabilising"] + by_kind["capsize", "destabilising"]) / 2
        assert (result.modes.model.eigenvalues(middle).real < 0).all()
