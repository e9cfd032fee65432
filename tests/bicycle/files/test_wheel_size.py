"""Markings of tyres as makers print them beside their ISO 5775 number, and what is refused with its candidates."""

import pytest

from bicycle.files import SIZES, read_wheel_size
from tyre.ground import InputError

SAME = {  # marking -> ISO 5775 number that makers print beside it (Michelin's and Schwalbe's lists of sizes)
    "28-622": "28-622", "622x28": "28-622", "622-28": "28-622", "700x28C": "28-622", "700 x 28 C": "28-622",
    "700C x 28": "28-622", "700x28": "28-622", "700-28c": "28-622", "28 x 1.10 (28-622)": "28-622",
    "28 x 1.10": "28-622", "ETRTO 37-622": "37-622", "28 x 1 5/8 x 1 3/8 (37-622)": "37-622", "25 – 622": "25-622",
    "26 x 1.75": "44-559", '26" x 1.95': "50-559", "47-559": "47-559", "26 x 1 3/8 (37-590)": "37-590",
    "650x35A": "35-590", "650 x 23C": "23-571", "650B x 47": "47-584", "27.5 x 2.25": "57-584", "29 × 2.1": "53-622",
    "20x1.75": "44-406", "20 x 1⅜": "35-451", "24x1.75": "44-507", "12½ x 2¼": "57-203", "27 x 1 1/4": "32-630",
    "27 x 1-1/4": "32-630", "16x1.75": "44-305", "28 x 1 1/2": "38-635", "28x7/8": "22-622",
}  # fmt: skip


@pytest.mark.parametrize("marking", SAME)
def test_a_marking_is_read(marking):
    assert str(read_wheel_size(marking)) == SAME[marking]


@pytest.mark.parametrize(
    ("marking", "candidates"),
    [
        ('26"', "this may be several rims: 559 mm (26 x a decimal such as 1.75); 571 mm (26 x 1, 26 x 1 1/2"),
        ("20", "406 mm (20 x a decimal such as 1.75); 451 mm (20 x 1 1/8, 20 x 1 1/4, 20 x 1 3/8); 419 mm"),
        ("700c", "the width is missing: 622 mm (700C)"), ("29er", "the width is missing: 622 mm"),
        ("650x47", "this may be several rims: 590 mm (650A); 584 mm (650B); 571 mm (650C)"),
        ("24 x 1 1/8", "520 mm (24 x 1 1/8); 540 mm"), ("24 x 1 3/8", "540 mm (24 x 1 3/8); 547 mm"),
        ("26 x 1 3/8", "590 mm (26 x 1 3/8); 597 mm (26 x 1 3/8)"), ("28 x 1 3/8", "622 mm (28 x 1 3/8); 642 mm"),
        ("28-662", "no tyre is made for a rim of 662 mm, the nearest are 630, 635, 642, 686"),
        ("280-622", "give width and rim in mm"), ("700x280C", "a tyre 280 mm wide is outside 12 to 130 mm"),
        ("28-62", "give width and rim in mm as printed on the tyre, such as 28-622"), ("", "give width and rim"),
        ("racing", "give width and rim"), ("26 x 1/0", "this may be several rims"), ("700x1 1/4", "give width and rim"),
    ],
)  # fmt: skip
def test_what_means_several_rims_gets_its_candidates(marking, candidates):
    with pytest.raises(InputError) as refusal:
        read_wheel_size(marking)
    assert candidates in str(refusal.value)


def test_no_size_is_listed_twice():
    assert len(set(SIZES)) == len(SIZES)
