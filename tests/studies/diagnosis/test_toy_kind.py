"""A kind of measurement that only this file knows goes through diagnosis, report and further measurements."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest
from read_report import read_report

from bicycle import Model, load_bicycle
from bicycle.effects import outside_effects
from studies.diagnosis import BicycleKind, Kind, diagnose, find, read_measurement, record, write_report
from studies.inference import Candidate, Proposal, Rows, UncertainParameter
from tyre.ground import InputError, needed, read, table

HEIGHT = 0.95  # m, of the saddle
SCALE = "saddle.scale"


@dataclass(frozen=True, kw_only=True)
class SaddleBalance(BicycleKind, kind="saddle"):
    """Lateral force of a spring balance at the saddle that holds a standing bicycle at lean angles, steer straight."""

    keys = table({needed("lean_rad"): list, needed("force_N"): list, needed("sd_N"): float})
    lean: np.ndarray
    force: np.ndarray
    sd: float

    @classmethod
    def read(cls, content, folder, common):
        given = read(cls.keys, content, section="saddle")
        return cls(**common, lean=np.array(given["lean_rad"]), force=np.array(given["force_N"]), sd=given["sd_N"])

    def mistakes(self):
        scale = UncertainParameter("scale", "1", {SCALE: 1.0}, 0.0, 0.1, -1.0, 1.0, size=True, least=0.002)
        words = "the balance reads too much or too little by a constant factor"
        return (Candidate("balance_scale", (scale,), signature=words, weight=0.5),)

    @cached_property
    def rows(self):
        where = tuple(f"lean {x:g} rad" for x in self.lean)
        fold = np.arange(len(where)) % 4
        return Rows(where, self.lean, ("force",) * len(where), fold, axis="lean angle, rad")

    @property
    def data(self):
        return self.force, np.full(len(self.force), self.sd)

    def predict(self, candidates, theta, lean=None):
        family = self.family(candidates)
        system, states = family(theta[None], np.zeros(1)), family.symbolic.states
        row, column = states.index("lean_rate"), states.index("lean")
        stiffness = float(system.dynamics[0, 0, row, column] / family.models.scale[column])
        scale = family.values(theta[None]).get(SCALE, np.zeros((1, 1)))[0, 0]
        return (1 + scale) * stiffness * (self.lean if lean is None else lean) / HEIGHT

    def propose_measurements(self):
        def steeper(candidates, theta):
            far = np.array([0.3])
            shift = 1e-6 * np.eye(len(theta))
            values = [self.predict(candidates, one, far) for one in (theta, *(theta + shift))]
            return values[0], np.stack([(value - values[0]) / 1e-6 for value in values[1:]], 1)

        return (Proposal("the force at a lean of 0.3 rad", np.full(1, self.sd), steeper),)


REGISTERED = Kind.top.pop("saddle"), Kind.part.pop("saddle")  # other tests list the kinds that there are
LEAN = np.array([-0.15, -0.1, -0.05, 0.05, 0.1, 0.15, 0.2, -0.2])


@pytest.fixture
def file(tmp_path, monkeypatch):
    """Forces that read 20 % too much, on a bicycle whose weight is known to 1 % (synthetic)."""
    for known, kind in zip((Kind.top, Kind.part), REGISTERED, strict=True):
        monkeypatch.setitem(known, "saddle", kind)
    parameters = load_bicycle("benchmark")
    exact = SaddleBalance(name="exact", model=Model(parameters), lean=LEAN, force=0 * LEAN, sd=1.0).prepare()
    noise = np.random.default_rng(1).standard_normal(len(LEAN))
    force = 1.2 * exact.predict((), exact.nominal) + 0.5 * noise
    given = f"lean_rad = {LEAN.tolist()}\nforce_N = {force.tolist()}\nsd_N = 0.5\n"
    path = tmp_path / "saddle.toml"
    exactly = "".join(f"{u.name} = 0\n" for u in exact.nuisances if u.name not in ("mB", "zB"))
    path.write_text(f'kind = "saddle"\nbicycle = "benchmark"\n[saddle]\n{given}[uncertainty]\n{exactly}')
    return path


def test_it_is_read_diagnosed_and_reported_without_a_line_elsewhere(file, tmp_path):
    measurement = read_measurement(file)
    assert isinstance(measurement, SaddleBalance)
    few = {"balance_scale", "steer_damper", "steer_spring"}
    others = {c.identifier for c in measurement.prepare().candidates} - few
    found = diagnose(measurement, without=tuple(sorted(others)))
    assert "balance_scale" in found.verdict.equivalent
    scale, sd = next(e for e in found.verdict.effects if e.identifier == "balance_scale").parameters["scale"]
    assert scale == pytest.approx(0.2, abs=4 * sd)
    findings = find(found)
    assert not findings.doubts
    write_report(found, tmp_path / "out", findings)
    assert "balance_scale" in read_report(tmp_path / "out")
    assert {"story.png", "before_after.png", "model.toml"} <= {path.name for path in (tmp_path / "out").iterdir()}
    assert record(found, findings)["measure_next"]


def test_a_further_measurement_is_predicted_and_ranked(file):
    kind = read_measurement(file).prepare()
    (proposal,) = kind.propose_measurements()
    scale = tuple(c for c in kind.candidates if c.identifier == "balance_scale")
    theta = np.array([*kind.nominal, 0.1])
    value, slope = proposal.predict_white(scale, theta)
    assert value == pytest.approx(1.1 * proposal.predict_white((), kind.nominal)[0])
    assert slope[:, -1] == pytest.approx(value / 1.1, rel=1e-4)


def test_slopes_follow_from_the_prediction(file):
    kind = read_measurement(file).prepare()
    residual, jacobian = kind.residual((), kind.nominal)
    assert kind.misfit((), kind.nominal) == pytest.approx(residual @ residual)
    step = 1e-4 * np.eye(len(kind.nominal))[0]
    moved, _ = kind.residual((), kind.nominal + step, slopes=False)
    assert jacobian[:, 0] == pytest.approx((moved - residual) / 1e-4, rel=1e-2, abs=1e-3)


def test_an_effect_with_the_name_of_an_error_of_the_measurement_is_refused(file, tmp_path):
    (tmp_path / "balance_scale.py").write_text(
        """from bicycle import Effect, Parameter

class Own(Effect):
    'A toy.'
    size = Parameter("N m/rad", "of the toy", bounds=(0.0, 9.0), typical=(1.0, 2.0), default=1.0, neutral=0.0)
    source = signature = "none"
    def apply(self, model):
        model.add_torque(model.steer, -self.size * model.steer.angle)
"""
    )
    measurement = read_measurement(file)
    words = "the effect 'balance_scale' of .*.py has the name of something that may be wrong with a measurement"
    with outside_effects([tmp_path / "balance_scale.py"]), pytest.raises(InputError, match=words):
        measurement.prepare()
