"""Sizes as printed on a bicycle tyre: 28-622, 622x28, 700x28C, 28 x 1.10, 26 x 1 3/8 (37-590)."""

import re
import unicodedata
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

from tyre.ground.errors import InputError


class Size(NamedTuple):
    """A wheel by its traditional name."""

    name: str  # outer diameter: inches, or about mm with the letter of the French system
    widths: str  # tyre widths with which the name means this rim: DECIMAL or a fraction of inches, or MM
    rim: int  # bead seat diameter, mm


DECIMAL, MM = "decimal", "mm"
SIZES = tuple(
    Size(*row)
    for row in (
        ("12", DECIMAL, 203),
        ("12.5", DECIMAL, 203),
        ("12.5", "2 1/4", 203),
        ("14", DECIMAL, 254),
        ("16", DECIMAL, 305),
        ("16", "1 3/8", 337),
        ("16", "1 3/8", 349),
        ("16", "1 1/4", 349),
        ("17", "1 1/4", 369),
        ("18", DECIMAL, 355),
        ("18", "1 3/8", 400),
        ("20", DECIMAL, 406),
        ("20", "1 1/8", 451),
        ("20", "1 1/4", 451),
        ("20", "1 3/8", 451),
        ("20", "1 3/4", 419),
        ("22", DECIMAL, 457),
        ("22", "1 3/8", 489),
        ("22", "1 3/8", 490),
        ("22", "1 3/8", 501),
        ("24", DECIMAL, 507),
        ("24", "1", 520),
        ("24", "1 1/8", 520),
        ("24", "1 1/8", 540),
        ("24", "1 1/4", 547),
        ("24", "1 3/8", 540),
        ("24", "1 3/8", 547),
        ("26", DECIMAL, 559),
        ("26", "1", 571),
        ("26", "1 1/4", 597),
        ("26", "1 3/8", 590),
        ("26", "1 3/8", 597),
        ("26", "1 1/2", 571),
        ("26", "1 1/2", 584),
        ("26", "1 3/4", 571),
        ("27", "1", 630),
        ("27", "1 1/8", 630),
        ("27", "1 1/4", 630),
        ("27", "1 3/8", 630),
        ("27.5", DECIMAL, 584),
        ("28", DECIMAL, 622),
        ("28", "7/8", 622),
        ("28", "1", 622),
        ("28", "1 5/8 x 1 1/8", 622),
        ("28", "1 5/8 x 1 1/4", 622),
        ("28", "1 5/8 x 1 3/8", 622),
        ("28", "1 3/8 x 1 5/8", 622),
        ("28", "1 3/8", 622),
        ("28", "1 3/8", 642),
        ("28", "1 1/2", 635),
        ("29", DECIMAL, 622),
        ("32", DECIMAL, 686),
        ("36", DECIMAL, 787),
        ("400a", MM, 340),
        ("450a", MM, 390),
        ("500a", MM, 440),
        ("550a", MM, 490),
        ("600a", MM, 541),
        ("650a", MM, 590),
        ("650b", MM, 584),
        ("650c", MM, 571),
        ("700a", MM, 642),
        ("700b", MM, 635),
        ("700c", MM, 622),
        ("700d", MM, 587),
        ("700", MM, 622),
    )
)
"""Rims of the traditional names: Brown, Tire Sizing Systems (sheldonbrown.com/tire-sizing.html), which lists ISO 5775's
bead seat diameters by name. A name that stands twice means several rims. 700 without a letter is 700C on every tyre."""

RIMS = {size.rim for size in SIZES} | {
    137,
    152,
    194,
    222,
    239,
    248,
    251,
    279,
    288,
    298,
    317,
    330,
    357,
    387,
    428,
    432,
    438,
    459,
    484,
    498,
    531,
    534,
    565,
    575,
    599,
    609,
}
"""Bead seat diameters (mm) that tyres are made for: of the names above, and further ones of the same lists."""
WIDTHS = (12.0, 130.0)  # mm, of bicycle tyres
ETRTO = re.compile(r"(?<![\d.])(\d{2,3})\s*-\s*(\d{3})(?![\d.])")  # width-rim, ISO 5775-1
TURNED = re.compile(r"(\d{3})\s*[-x]\s*(\d{2,3})")  # rim x width
NAMED = re.compile(
    r"(?P<name>\d+(?:\.\d+| 1/2)?)\s*(?P<letter>[a-d])?\s*(?:er)?"
    r"(?:\s*(?P<between>[x-])\s*(?P<width>\d[\d ./x-]*?)\s*(?P<last>[a-d])?)?"
)


class WheelSize(NamedTuple):
    """Rim and tyre by ISO 5775: bead seat diameter and nominal width, mm."""

    rim: float  # bead seat diameter, mm
    width: float  # nominal, mm

    def __str__(self) -> str:
        return f"{self.width:.0f}-{self.rim:.0f}"


def read_wheel_size(text: str) -> WheelSize:
    """Read the marking of a tyre; InputError with the candidates where it means several rims, or lacks the width."""
    plain = _normalise(text)
    marked = ETRTO.search(plain)
    if marked and float(marked[1]) < float(marked[2]):
        return _check_size(text, float(marked[2]), float(marked[1]))
    turned = TURNED.fullmatch(plain)
    if turned and int(turned[1]) in RIMS:
        return _check_size(text, float(turned[1]), float(turned[2]))
    named = NAMED.fullmatch(re.sub(r"\(.*", "", plain).strip())
    if named is None:
        raise InputError(f"{text!r}: {HOW}")
    name = named["name"].replace(" 1/2", ".5").removesuffix(".0") + (named["letter"] or named["last"] or "")
    sizes = [size for size in SIZES if size.name == name]
    if not sizes:
        sizes = [size for size in SIZES if size.name[:-1] == name and size.widths == MM]
    width = (named["width"] or "").strip()
    if named["between"] == "-" and all(size.widths != MM for size in sizes):  # 28-62 is no 28 x 62
        sizes = []
    meant = _with_width(sizes, width)
    if len({size.rim for size in meant}) != 1 or not width:
        raise InputError(f"{text!r}: {_candidates(meant or sizes, without_width=not width)}{HOW}")
    try:
        width_mm = _width_mm(width, meant[0].widths)
    except (ValueError, ZeroDivisionError):
        raise InputError(f"{text!r}: the width {width!r} is not read; {HOW}") from None
    return _check_size(text, meant[0].rim, width_mm)


HOW = "give width and rim in mm as printed on the tyre, such as 28-622; or 700x28C, 28 x 1.10, 26 x 1.75"


def _normalise(text: str) -> str:
    """Lower case, x between the numbers, no signs of inches, fractions of one letter (½) written out."""
    letters = [
        f" {unicodedata.normalize('NFKC', letter)}" if unicodedata.category(letter) == "No" else letter
        for letter in text
    ]
    plain = "".join(letters).casefold().replace("\N{FRACTION SLASH}", "/")
    for sign in "×*":
        plain = plain.replace(sign, "x")
    for sign in "–—−":
        plain = plain.replace(sign, "-")
    plain = re.sub(r"\"|″|”|''|\binch(es)?\b|\bin\b|\betrto\b|\biso\b", " ", plain)
    return re.sub(r"\s+", " ", plain.replace(",", ".")).strip()


def _with_width(sizes: Sequence[Size], width: str) -> list[Size]:
    """The sizes that have a width: by its fraction, else all decimal widths and those in mm."""
    if not width:
        return list(sizes)
    fraction = re.sub(r"\s*x\s*", " x ", width.replace("-", " ")).strip()
    exact = [size for size in sizes if size.widths == fraction]
    decimal = "/" not in width and "x" not in width and not exact
    return exact or [size for size in sizes if decimal and size.widths in (DECIMAL, MM)]


def _width_mm(width: str, widths: str) -> float:
    if widths == MM:
        return float(width)
    parts = [sum(map(Fraction, part.replace("-", " ").split())) for part in width.split("x")]
    return 25.4 * float(min(parts))


def _candidates(sizes: Sequence[Size], *, without_width: bool) -> str:
    if not sizes:
        return ""
    rims: dict[int, list[str]] = {}
    for size in sizes:
        widths = "a decimal such as 1.75" if size.widths == DECIMAL else size.widths
        size_text = size.name.upper() if size.widths == MM else f"{size.name} x {widths}"
        rims.setdefault(size.rim, []).append(size_text)
    meanings = "; ".join(f"{rim} mm ({', '.join(names)})" for rim, names in rims.items())
    why = "the width is missing" if without_width and len(rims) == 1 else "this may be several rims"
    return f"{why}: {meanings}; "


def _check_size(text: str, rim: float, width: float) -> WheelSize:
    if not WIDTHS[0] <= width <= WIDTHS[1]:
        raise InputError(f"{text!r}: a tyre {width:g} mm wide is outside {WIDTHS[0]:g} to {WIDTHS[1]:g} mm; {HOW}")
    if rim not in RIMS:
        nearest = sorted(sorted(RIMS, key=lambda listed: abs(listed - rim))[:4])
        rims = ", ".join(map(str, nearest))
        raise InputError(f"{text!r}: no tyre is made for a rim of {rim:g} mm, the nearest are {rims}; {HOW}")
    return WheelSize(rim, width)
