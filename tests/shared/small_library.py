"""A diagnosis with few hypotheses, for what does not hang on how many are tried; the blind test tries them all."""

from collections.abc import Collection

from studies.diagnosis import Diagnosis, diagnose
from studies.inference import Kind


def all_but(measurement: Kind, tried: Collection[str]) -> tuple[str, ...]:
    """Names to leave out, so that those in ``tried`` are the whole library; each of them must be known."""
    known = {candidate.identifier for candidate in measurement.prepare().candidates}
    assert set(tried) <= known, sorted(set(tried) - known)
    return tuple(sorted(known - set(tried)))


def among(measurement: Kind, tried: Collection[str]) -> Diagnosis:
    """Diagnosis among these hypotheses, of data as they stand: tests of other readings judge units and signs."""
    return diagnose(measurement, without=all_but(measurement, tried), as_read=True)
