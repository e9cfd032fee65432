"""What a number of a model is called: ``c`` of the bicycle, ``effect.name`` or ``effect.name.wheel`` of an effect.

>>> key = ParameterKey.parse("relaxation_length.cornering_stiffness.rear")
>>> key.effect, key.name, key.wheel
('relaxation_length', 'cornering_stiffness', 'rear')
>>> str(key.of("front"))
'relaxation_length.cornering_stiffness.front'
"""

from collections.abc import Container
from dataclasses import dataclass, replace

from tyre.base.errors import InputError, shown

WHEELS = ("rear", "front")


@dataclass(frozen=True)
class ParameterKey:
    """The key of one parameter, or of both wheels' values of it.

    Attributes
    ----------
    effect : str
        Identifier of the effect; empty for a parameter of the bicycle or a condition of its tyres.
    name : str
        Name of the parameter.
    wheel : str
        ``rear`` or ``front``; empty for one number, or for both wheels together.

    Raises
    ------
    InputError
        A name that is empty, is a wheel or has a dot, or a wheel that there is not.
    """

    effect: str
    name: str
    wheel: str = ""

    def __post_init__(self) -> None:
        plain = all("." not in part for part in (self.effect, self.name))
        if not plain or not self.name or self.name in WHEELS or self.wheel not in ("", *WHEELS):
            raise InputError(
                f"parameter {shown(str(self))}: write a key of the bicycle, effect.name or effect.name.wheel, "
                f"with {' or '.join(WHEELS)} for the wheel"
            )

    @classmethod
    def parse(cls, text: "str | ParameterKey") -> "ParameterKey":
        """The key that is written so.

        Parameters
        ----------
        text : str or ParameterKey
            ``name``, ``effect.name``, either with ``.rear`` or ``.front`` behind it; a key is given back as it is.

        Raises
        ------
        InputError
            Text of another form.
        """
        if isinstance(text, ParameterKey):
            return text
        head, _, last = text.rpartition(".")
        rest, wheel = (head, last) if head and last in WHEELS else (text, "")
        effect, dot, name = rest.rpartition(".")
        if dot and not effect:
            raise InputError(f"parameter {shown(text)}: the name of the effect before the dot is missing")
        return cls(effect, name, wheel)

    def __str__(self) -> str:
        return ".".join(part for part in (self.effect, self.name, self.wheel) if part)

    @property
    def entry(self) -> str:
        """``name`` or ``name.wheel``, as the effect itself calls it."""
        return ".".join(part for part in (self.name, self.wheel) if part)

    @property
    def whole(self) -> "ParameterKey":
        """The key without the wheel: of both wheels' values together."""
        return replace(self, wheel="")

    def of(self, wheel: str) -> "ParameterKey":
        """The key of one wheel's value.

        Parameters
        ----------
        wheel : str
            ``rear`` or ``front``.
        """
        return replace(self, wheel=wheel)


def entries_of(key: str, known: Container[str]) -> tuple[str, ...]:
    """Which of the ``known`` parameters a key stands for.

    Parameters
    ----------
    key : str
        A key as it is written.
    known : container of str
        Every single parameter of a model.

    Returns
    -------
    tuple of str
        The key itself, else rear and front of a parameter per wheel (one of them where only one is known); empty where
        no parameter is called so.
    """
    if key in known:
        return (key,)
    return tuple(entry for entry in (f"{key}.{wheel}" for wheel in WHEELS) if entry in known)
