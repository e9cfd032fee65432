"""Damage of the tables of a TOML file: keys and values, the rest as valid as before."""

import copy
import pickle
import random
import tomllib
from collections.abc import Callable
from functools import lru_cache
from typing import Any

Way = Callable[[bytes, random.Random], bytes]

_LARGE = 10**400
HOSTILE_VALUES: tuple[Any, ...] = (
    0, -1, 1, 2, 1e308, -1e308, 1e-308, 5e-324, 1e-12, 1e12, 10**15, -(10**18), _LARGE, float("nan"), float("inf"),
    float("-inf"), True, False, "", " ", "1", "1.5", "nan", "a", "a" * 100_000, "\0", "\x07", "é\u202e", "1_0", "٣",
    "Tyre1", "benchmark", "model.toml", ".", "/", "C:\\x", "$HOME", [], [1.0], [[1.0]], ["a"], [0.0] * 1000, {},
    {"rear": 1.0}, {"rear": 1.0, "front": 1.0}, {"a": {"b": {"c": 1}}}, {"value": 1.0, "sd": 0.1}, -0.0, 0.5, 3, 57.3,
)  # fmt: skip
FACTORS = (1e3, 1e-3, -1.0, 57.29577951308232, 1e-30, 1e30, 1e150, 1e-150, 3.6, 100.0, 1.0 + 1e-12, 0.1, 10.0, 2.0)


def _spots(tree: Any) -> list[tuple[Any, Any]]:
    """Every (table or list, key or place) within a tree."""
    found = []
    for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree):
        found.append((tree, key))
        if isinstance(value, dict) or (isinstance(value, list) and len(value) < 200):
            found += _spots(value)
    return found


def _in_toml(change: Callable[[dict[str, Any], random.Random], None], content: bytes, rng: random.Random) -> bytes:
    import tomli_w

    tree = pickle.loads(_parsed(content))
    change(tree, rng)
    return tomli_w.dumps(tree).encode("utf-8", "surrogatepass")


@lru_cache(200)
def _parsed(content: bytes) -> bytes:
    """A TOML file as a pickle, quicker to copy than to parse."""
    return pickle.dumps(tomllib.loads(content.decode("utf-8")))


def _key_away(content: bytes, rng: random.Random) -> bytes:
    def change(tree: dict[str, Any], rng: random.Random) -> None:
        place, key = rng.choice(_spots(tree))
        del place[key]

    return _in_toml(change, content, rng)


def _key_renamed(content: bytes, rng: random.Random) -> bytes:
    def change(tree: dict[str, Any], rng: random.Random) -> None:
        place, key = rng.choice([spot for spot in _spots(tree) if isinstance(spot[0], dict)])
        place[misspelt(key, rng)] = place.pop(key)

    return _in_toml(change, content, rng)


def _key_moved(content: bytes, rng: random.Random) -> bytes:
    def change(tree: dict[str, Any], rng: random.Random) -> None:
        place, key = rng.choice(_spots(tree))
        value = place[key]
        del place[key]
        targets = [tree, *(p[k] for p, k in _spots(tree) if isinstance(p[k], dict))]
        rng.choice(targets)[str(key)] = value

    return _in_toml(change, content, rng)


def _key_twice(content: bytes, rng: random.Random) -> bytes:
    def change(tree: dict[str, Any], rng: random.Random) -> None:
        place, key = rng.choice(_spots(tree))
        other, there = rng.choice(_spots(tree))
        other[there] = copy.deepcopy(place[key])

    return _in_toml(change, content, rng)


def _value_of_another_sort(content: bytes, rng: random.Random) -> bytes:
    def change(tree: dict[str, Any], rng: random.Random) -> None:
        place, key = rng.choice(_spots(tree))
        place[key] = copy.deepcopy(rng.choice(HOSTILE_VALUES))

    return _in_toml(change, content, rng)


def _value_scaled(content: bytes, rng: random.Random) -> bytes:
    def change(tree: dict[str, Any], rng: random.Random) -> None:
        numbers = [(p, k) for p, k in _spots(tree) if isinstance(p[k], int | float) and not isinstance(p[k], bool)]
        place, key = rng.choice(numbers)
        place[key] = float(place[key]) * rng.choice(FACTORS)

    return _in_toml(change, content, rng)


def _value_wrapped(content: bytes, rng: random.Random) -> bytes:
    def change(tree: dict[str, Any], rng: random.Random) -> None:
        place, key = rng.choice(_spots(tree))
        place[key] = rng.choice(([place[key]], {"value": place[key]}, {str(key): place[key]}, str(place[key])[:1000]))

    return _in_toml(change, content, rng)


def misspelt(key: str, rng: random.Random) -> str:
    """A ``key`` with a slip, drawn with ``rng``."""
    place = rng.randrange(len(key) + 1)
    return rng.choice(
        (key[:place] + rng.choice("xé_.-# |\0") + key[place:], key[:-1], key.upper(), key.swapcase(), key[::-1],
         f" {key}", key * 200, "", key.replace("e", "е"), "__class__", "self")
    )  # fmt: skip


TREE: tuple[Way, ...] = (
    _key_away, _key_away, _key_renamed, _key_moved, _key_twice, _value_of_another_sort, _value_of_another_sort,
    _value_of_another_sort, _value_scaled, _value_scaled, _value_wrapped,
)  # fmt: skip
