"""Parameters of a bicycle as a file gives them: numbers with units, standard deviations, words; a bicycle of them."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

import numpy as np

from bicycle.parameters import bicycle as parameters
from bicycle.parameters.bicycle import ALIASES, HEAD_ANGLE, KINDS, ODD_IN_Z, UNITS, UNUSED, Z_UP, Bicycle
from bicycle.parameters.parameter_covariance import FILE, ParameterCovariance, read_covariance
from bicycle.rider.rider_body import RigidBody, as_rear_frame, join, rear_frame
from tyre.ground import schema
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, is_number, nearest_name, refuse_unknown, shown
from tyre.ground.number_with_sd import MeasuredNumber, measured_number
from tyre.ground.schema import any_table
from tyre.ground.units import factor_to_si
from tyre.measured.plausible import WAY_OUT

LEFT_OUT = {"v": "", "yB": "", "yH": "", "IRzz": "IRxx", "IFzz": "IFxx"}  # key -> the key whose value it must have
FORK_OFFSET = "fork_offset"
"""Key in place of the trail c: distance of the front hub before the steer axis, at right angles to it (rake), m."""
KEYS = (*UNITS, *UNUSED, FORK_OFFSET)
NAMES = {**ALIASES, "rake": FORK_OFFSET}  # everyday name -> key
FLAGS = (WAY_OUT, Z_UP)
COVARIANCE = "covariance"  # table of a bicycle, in its file or in a model file
WORDS = ("description", "source", "kind")
GROUPS = {"length": "m", "angle": "rad", "mass": "kg", "inertia": "kg m^2"}
"""Names under which a file states the unit of all parameters of one sort."""

NOT_USED = {
    "v": "{where}: the speed v = {number:g} m/s is not a property of the bicycle and is not used",
    "yB": "{where}: {key} = {number:g} is not used: the bicycle is taken as symmetric",
    "IRzz": "{where}: {key} = {number:g} is not used: a wheel is symmetric about its axle, so {twin} is taken",
}
NOT_USED |= {"yH": NOT_USED["yB"], "IFzz": NOT_USED["IRzz"]}
PI = re.compile(r"(?P<sign>-?)(?:(?P<times>[\d.]+)\s*\*?\s*)?pi(?:\s*/\s*(?P<over>[\d.]+))?")
USUAL_OFFSET = (0.0, 0.12)  # m, of a fork that is not reversed; far outside, the unit is wrong
PENDULUM = re.compile(r"T[ct][A-Z]\w*\d")  # period of a compound or torsional pendulum, named as BicycleParameters does

BODY = schema.table(
    {
        schema.needed("mass"): schema.number(above=0, most=300, says="must be a mass in kg, up to 300"),
        schema.needed("place"): schema.list_of(
            schema.number(), "must be [m before the rear contact, m above the ground]", least=2, most=2
        ),
        schema.maybe("size", [0.0, 0.0, 0.0]): schema.list_of(
            schema.number(least=0), "must be [length, width, height] in m", least=3, most=3
        ),
        schema.maybe("inertia"): schema.list_of(
            schema.number(), "must be [Ixx, Iyy, Izz], or [Ixx, Iyy, Izz, Ixz], in kg m^2", least=3, most=4
        ),
        schema.maybe("name", ""): schema.text(),
        schema.maybe("on", "frame"): schema.text("must be 'frame' or 'front'", allowed=("frame", "front")),
    }
)
BODIES = schema.list_of(BODY, "must be tables: write [[bodies]] with mass, place and size", strict=False)
"""A rider, luggage, a child seat: boxes or given inertias, fixed to the rear frame, or turning with the front one."""


def si_unit(key: str) -> str:
    """The SI unit of a ``key`` of a bicycle file, also of one that is left out."""
    return "m/s" if key == "v" else "m" if key in ("yB", "yH", FORK_OFFSET) else UNITS.get(key, "kg m^2")


def trail_of_offset(offset: float, lam: float, radius: float) -> float:
    """Trail (m) of a fork whose hub lies an ``offset`` (m) before the steer axis; front ``radius`` (m)."""
    return (radius * math.sin(lam) - offset) / math.cos(lam)


@dataclass
class GivenNumbers:
    """Content of a file: numbers, one :meth:`add` each, in its order, and the words beside them."""

    # unit of what is written without one, by key or by a name of :data:`GROUPS`; else SI
    units: Mapping[str, str] = field(default_factory=dict)
    values: dict[str, Any] = field(default_factory=dict)  # SI, lam in rad
    sd: dict[str, Any] = field(default_factory=dict)  # SI, lam in rad
    notes: list[str] = field(default_factory=list)  # what is not used
    words: dict[str, str] = field(default_factory=dict)  # of :data:`WORDS`
    allow_unusual: bool = False  # the file lets values pass that are far from those of other bicycles
    z_up: bool = False  # its z axis points up
    # joint, of numbers that the file states together; empty without
    covariance: ParameterCovariance = field(default_factory=ParameterCovariance)
    bodies: list[Mapping[str, Any]] = field(default_factory=list)  # as :data:`BODIES` has them
    _left_out: dict[str, tuple[str, float]] = field(default_factory=dict)  # key of :data:`LEFT_OUT` -> place, number
    _others: list[str] = field(default_factory=list)  # keys that are not those of a bicycle

    def __post_init__(self) -> None:
        refuse_unknown("key of units:", self.units, [*KEYS, *GROUPS])
        for key, unit in self.units.items():
            if not isinstance(unit, str):
                raise InputError(f'units: {key} = {shown(unit)} must be a unit in quotes, such as "mm"')
            factor_to_si(unit, GROUPS.get(key) or si_unit(key), where=f"units: {key}")

    def add(self, key: str, value: Any, *, where: str, unit: str = "") -> None:
        """Add the value of a parameter."""
        if key == HEAD_ANGLE:
            angle = self._number("lam", value, where, unit or "deg")
            self.sd |= {} if angle.sd is None else {"lam": angle.sd}
            key, value, unit = "lam", math.pi / 2 - angle.value, "rad"
        key = NAMES.get(key, key)
        if key in self.values or key in self._left_out or key in self._others:
            raise InputError(f"{where}: {key} is given twice; keep one")
        if key not in KEYS and key not in LEFT_OUT:
            self._others.append(key)
            return
        number = self._number(key, value, where, unit)
        if key in LEFT_OUT:
            self._left_out[key] = (where, number.value)
            return
        self.values[key] = number.value
        if number.sd is not None:
            self.sd[key] = number.sd

    def add_sd(self, key: str, value: Any, *, where: str, unit: str = "") -> None:
        """Add a standard deviation that is uncorrelated."""
        key, unit = ("lam", unit or "deg") if key == HEAD_ANGLE else (NAMES.get(key, key), unit)
        if key in self.sd:
            raise InputError(f"{where}: the standard deviation of {key} is given twice; keep one")
        if key in LEFT_OUT or key in self._others:
            return
        refuse_unknown("key", [key], KEYS, where=f"{where}: standard deviation")
        number = self._number(key, value, where, unit)
        if number.sd is not None:
            raise InputError(
                f"{where}: the standard deviation of {key} = {value!r} has one of its own; give one number"
            )
        self.sd[key] = number.value

    def add_covariance(self, content: Mapping[str, Any], *, where: str) -> None:
        """Add the joint covariance (SI) of parameters whose values are there: a table with its matrix or factor."""
        self.covariance = read_covariance(content, self.values, where=where)
        for key in self.covariance.names:
            if key in self.sd:
                raise InputError(f"{where}: {key} has an sd of its own already; keep one of them")

    def add_word(self, key: str, value: Any, *, where: str) -> None:
        """Add a text of :data:`WORDS`, or one of :data:`FLAGS`."""
        text = str(value) if key in ("description", "source") else str(value).strip()
        if key == "kind":
            refuse_unknown("kind of vehicle", [text], KINDS, where=where)
        if key not in FLAGS:
            self.words[key] = text
        elif text.lower() not in ("true", "false"):
            raise InputError(f"{where}: {key} = {shown(value)} must be true or false")
        else:
            setattr(self, key, text.lower() == "true")

    def bicycle(self, name: str, kind: str, *, place: str = "", allow_unusual: bool = False) -> Bicycle:
        """The bicycle of a ``kind`` of file; ``place`` begins an error."""
        allow, notes = allow_unusual or self.allow_unusual, list(self.notes)
        vehicle = self.words.get("kind", "bicycle")
        for key, (where, number) in self._left_out.items():
            twin = LEFT_OUT[key]
            if key == "v" or number != self.values.get(twin, 0.0):  # else symmetry gives its value
                notes.append(NOT_USED[key].format(where=where, key=key, number=number, twin=twin))
        begin = f"{place}: " if place else ""
        if self._others:
            notes.append(f"{begin}not used, as the lateral motion does not hold them: {', '.join(self._others)}")
        try:
            self._turn_down()
            self._find_trail()
            self._refuse_incomplete()
            if not allow:
                way = f"write {WAY_OUT} = true at the top of the {kind}"
                parameters.refuse_unlikely(self.values, self.sd, way, vehicle)
            for wheel in "RF":  # a skate: without mass and spin the size of a wheel has no effect
                parts = (f"r{wheel}", f"m{wheel}", f"I{wheel}xx", f"I{wheel}yy")
                if not any(self.values.get(key, 1.0) for key in parts):
                    notes.append(f"{begin}r{wheel} = 0 m: a wheel that is nothing; 0.3 m is taken, of no effect")
                    self.values[f"r{wheel}"] = 0.3
            if self.bodies and set(UNITS) <= set(self.values):
                self._load()
            return Bicycle(
                name, self.values, self.sd, notes=tuple(notes), covariance=self.covariance, unusual=allow, **self.words
            )
        except InputError as error:
            # a centre of mass in cm is a wheel without load, so an error names the unusual number too
            doubts = [doubt for doubt in parameters.doubts_about(self.values, vehicle) if doubt.explained]
            causes = [doubt.text for doubt in doubts if f"{doubt.key} = " not in str(error)]
            units = [doubt for doubt in doubts if doubt.key not in ODD_IN_Z]
            remedy = [parameters.NAME_THE_UNIT] if units and parameters.NAME_THE_UNIT not in str(error) else []
            raise InputError(begin + "; ".join([str(error), *causes[:1], *remedy])) from error

    def _refuse_incomplete(self) -> None:
        """Refuse a file without all parameters, with the keys it has in their place, or named for what it is."""
        missing = [key for key in UNITS if key not in self.values]
        periods = [key for key in self._others if PENDULUM.fullmatch(key)]
        if missing and periods:
            raise InputError(
                f"holds raw measurements (periods of pendulums {', '.join(periods[:3])}, ...), not the parameters that "
                f"follow from them ({', '.join(missing[:3])}, ...); give the file that BicycleParameters computes of it"
            )
        suggestions = {name: nearest_name(name, missing, cutoff=0.75) for name in self._others}
        hints = [f"did you mean {key!r} by {name!r}?" for name, key in suggestions.items() if key]
        if missing and self._others:
            raise InputError(
                "; ".join(
                    [
                        f"missing {', '.join(missing)}",
                        *hints,
                        f"not known: {', '.join(self._others)}",
                        f"give every parameter ({', '.join(UNITS)})",
                    ]
                )
            )

    def _turn_down(self) -> None:
        """Turn a file whose z axis points up, with y to the left: what is odd in z changes its sign."""
        if not self.z_up:
            return
        for key in ("zB", "zH"):
            if self.values.get(key, 0.0) < 0:
                raise InputError(
                    f"{Z_UP} = true, but {key} = {self.values[key]:g} m: heights are positive then; take {Z_UP} out if "
                    "z points down"
                )
        self.values |= {key: -self.values[key] for key in ODD_IN_Z if key in self.values}
        signs = np.array([-1.0 if key in ODD_IN_Z else 1.0 for key in self.covariance.names])
        self.covariance = replace(self.covariance, matrix=self.covariance.matrix * np.outer(signs, signs))

    def _find_trail(self) -> None:
        """Put the trail c = (rF sin lam - offset) / cos lam in the place of the fork's offset.

        Where the offset has an sd, c is correlated with lam and rF: their joint covariance.
        """
        if FORK_OFFSET not in self.values:
            return
        if "c" in self.values:
            raise InputError(f"c and {FORK_OFFSET} both give the trail; keep one")
        if not {"lam", "rF"} <= set(self.values):
            raise InputError(f"the trail of {FORK_OFFSET} needs lam and rF; give them")
        offset = self.values.pop(FORK_OFFSET)
        odd = parameters.doubt(FORK_OFFSET, offset, unit="m", typical=USUAL_OFFSET)
        if odd and odd.absurd:
            raise InputError(f"{odd.text}; {parameters.NAME_THE_UNIT}")
        lam, radius = self.values["lam"], self.values["rF"]
        self.values["c"] = trail_of_offset(offset, lam, radius)
        if FORK_OFFSET not in (*self.sd, *self.covariance.names):
            return
        slopes = {
            "lam": (radius - offset * math.sin(lam)) / math.cos(lam) ** 2,
            "rF": math.tan(lam),
            FORK_OFFSET: -1 / math.cos(lam),
        }
        separate_sd = {key: self.sd.pop(key) for key in slopes if key in self.sd}
        single = ParameterCovariance(tuple(separate_sd), np.diag(np.square(list(separate_sd.values()))))
        before = self.covariance.and_also(single)
        staying = [key for key in before.names if key != FORK_OFFSET]
        rows = np.array(
            [
                *([float(key == name) for key in before.names] for name in staying),
                [slopes.get(key, 0.0) for key in before.names],
            ]
        )
        self.covariance = ParameterCovariance((*staying, "c"), rows @ before.matrix @ rows.T, origin=FILE)

    def _load(self) -> None:
        """Join the bodies to the frames: values, and their standard deviations to first order."""
        carried: dict[str, list[RigidBody]] = {"B": [], "H": []}
        for body in self.bodies:
            carried["H" if body["on"] == "front" else "B"].append(carried_body(body, z_up=self.z_up))

        def loaded(values: Mapping[str, float]) -> dict[str, float]:
            joined = dict(values)
            for part, boxes in carried.items():
                joined |= as_rear_frame(join([rear_frame(values, part), *boxes]), part) if boxes else {}
            return joined

        def slopes(names: Sequence[str]) -> Array:
            columns = []
            for name in names:
                more, less = (loaded({**self.values, name: self.values[name] + step}) for step in (1e-4, -1e-4))
                columns.append([(more[key] - less[key]) / 2e-4 for key in names])
            return np.array(columns).T

        sd_of_parameters = {key: sd for key, sd in self.sd.items() if key in UNITS}
        if sd_of_parameters:
            variances = slopes(list(sd_of_parameters)) ** 2 @ np.array(list(sd_of_parameters.values())) ** 2
            self.sd |= dict(zip(sd_of_parameters, np.sqrt(variances).tolist(), strict=True))
        if self.covariance.names:
            j = slopes(self.covariance.names)
            self.covariance = replace(self.covariance, matrix=j @ self.covariance.matrix @ j.T)
        self.values = loaded(self.values)

    def _number(self, key: str, value: Any, where: str, unit: str) -> MeasuredNumber:
        si = si_unit(key)
        unit = unit or self.units.get(key) or next((u for n, u in self.units.items() if GROUPS.get(n) == si), si)
        if isinstance(value, str):
            match = PI.fullmatch(value.strip())
            if match is None:
                return measured_number(value, where=where, key=key, si=si, unit=unit)
            sign, times, over = match.group("sign", "times", "over")
            try:
                value = float(f"{sign}1") * float(times or 1) * math.pi / float(over or 1)
            except (ValueError, ZeroDivisionError):
                raise InputError(f"{where}: {key} = {value!r} is not a number; write for example pi/10") from None
        if unit == si or not is_number(value) or value - value != 0:
            return MeasuredNumber(value)  # the bicycle itself refuses what is no finite number
        return MeasuredNumber(float(Fraction(float(value)) * factor_to_si(unit, si, where=where)))


def given_numbers(
    values: Mapping[str, Any],
    sd: Mapping[str, Any] | None = None,
    units: Mapping[str, Any] | None = None,
    *,
    place: str = "[values]",
) -> GivenNumbers:
    """Numbers of the tables of a TOML file, each a number or text such as ``"18.3(2) deg"``."""
    numbers = GivenNumbers(units or {})
    for key, value in values.items():
        if key in (*WORDS, Z_UP):
            numbers.add_word(key, value, where=place)
        elif key not in (COVARIANCE, "bodies"):
            numbers.add(key, value, where=place)
    for key, value in (sd or {}).items():
        numbers.add_sd(key, value, where="[sd]")
    if COVARIANCE in values:
        numbers.add_covariance(any_table(values[COVARIANCE]), where=f"{place}: {COVARIANCE}")
    numbers.bodies = schema.read(BODIES, values.get("bodies", []), where=place, section="bodies")
    return numbers


def read_body(content: Mapping[str, Any]) -> RigidBody:
    """The rigid body of an entry of ``[[bodies]]`` that is not checked yet."""
    return carried_body(schema.read(BODY, content, where="body"))


def carried_body(content: Mapping[str, Any], *, z_up: bool = False) -> RigidBody:
    """The rigid body of an entry of :data:`BODIES`: of its own inertia, else a box of its size, else a point."""
    (x, height), (length, width, tall) = content["place"], content["size"]
    mass, name = content["mass"], content["name"] or f"of {content['mass']:g} kg"
    if "inertia" not in content:
        squares = np.array([width**2 + tall**2, length**2 + tall**2, length**2 + width**2])
        inertia = np.diag(mass / 12 * squares)
    elif any(content["size"]):
        raise InputError(f"body {name}: size and inertia both give its inertia; keep one")
    else:
        xx, yy, zz, *product = content["inertia"]
        xz = product[0] if product else 0.0
        xz = -xz if z_up else xz
        inertia = np.array([[xx, 0.0, xz], [0.0, yy, 0.0], [xz, 0.0, zz]])
        least, middle, largest = np.linalg.eigvalsh(inertia)
        if least < 0 or largest > (least + middle) * (1 + 1e-9):
            raise InputError(
                f"body {name}: no rigid body has the principal inertias {least:.4g}, {middle:.4g} and {largest:.4g} "
                "kg m^2; none may be negative or more than the other two together"
            )
    return RigidBody(mass, np.array([x, 0.0, -height]), inertia)


def model_table(bicycle: Bicycle) -> dict[str, Any]:
    """Write a bicycle as the table of a model file, which :func:`given_numbers` reads back: all that is known of it."""
    together = bicycle.covariance.names
    table: dict[str, Any] = {} if bicycle.kind == "bicycle" else {"kind": bicycle.kind}
    for key, value in bicycle.values.items():
        is_separate = key in bicycle.sd and key not in together
        table[key] = f"{value!r} +/- {bicycle.sd[key]!r}" if is_separate else value
    return table | covariance_table(bicycle.covariance)


def covariance_table(covariance: ParameterCovariance) -> dict[str, Any]:
    """Write a joint covariance as the table ``covariance`` of a file; nothing if there is none."""
    if not covariance.names:
        return {}
    return {COVARIANCE: {"parameters": list(covariance.names), "matrix": covariance.matrix.tolist()}}
