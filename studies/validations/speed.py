"""How fast velotyre is: ratios against peers, LAPACK and plain loops, measured in one run; medians.

The table goes to benchmarks.md beside the JSON, row by row, and whole to --table. A quiet machine matters: other work
on it spoils every ratio with threads. What cannot be measured here is listed with the reason.
"""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from bicycle.eigenvalues.solvers import Solver
from studies.validations import _speed_of_charts as of_charts
from studies.validations import _speed_of_eigenvalues as of_eigenvalues
from studies.validations import _speed_of_names as of_names
from studies.validations import _speed_of_studies as of_studies
from studies.validations import _speed_timing as timing
from tyre.base.files import write_text

Row = dict[str, Any]
Measured = Callable[[], Row]


def run(*, out: Path, quick: bool = False, table: str = "") -> dict[str, Any]:
    """Measure every row.

    Parameters
    ----------
    out : Path
        Folder for the page.
    quick : bool
        Small sizes: about a minute instead of a quarter of an hour.
    table : str
        File for the finished page besides ``benchmarks.md`` in ``out``, which holds what is measured so far.
    """
    from tyre.base.progress import progress_bar

    machine = timing.machine()
    rows: list[Row] = []
    for name, target, measured in progress_bar(list(_rows(quick=quick)), desc="rows"):
        row: Row = {"figure": name, "target": target}
        try:
            row |= measured()
        except Exception as error:  # a peer that is missing or broken must not cost the other rows
            row |= {"measured": None, "met": None, "note": f"not measured: {type(error).__name__}: {error}"}
        rows.append(row)
        write_text(out / "benchmarks.md", markdown({"machine": machine, "quick": quick, "rows": rows}))
    result = {"machine": machine, "quick": quick, "rows": rows}
    if table:
        write_text(Path(table), markdown(result))
    return result


def _rows(*, quick: bool) -> Iterator[tuple[str, str, Measured]]:
    few, repeats = (10, 1) if quick else (1, 5)
    speeds, bicycles, points = 100_000 // few, 100_000 // few, 1_000_000 // few
    for path, over_speeds, over_bicycles in (("numpy", 10, 15), ("fast", 50, 50)):
        solver = timing.SOLVERS[path]
        yield (
            f"4 states over {speeds} speeds against bicycleparameters' calc_eigen, {path}", f">= {over_speeds} x",
            _faster(over_speeds, speeds, of_eigenvalues.peer_speeds, speeds, solver, repeats),
        )  # fmt: skip
        yield (
            f"{bicycles // 5} distinct 4-state bicycles against bicycleparameters' calc_eigen, {path}", "",
            _faster(None, bicycles // 5, of_eigenvalues.peer_bicycles, bicycles // 5, solver, min(repeats, 3)),
        )  # fmt: skip
        yield (
            f"{bicycles} distinct bicycles, 8 states, assembly included, against a Python loop, {path}",
            f">= {over_bicycles} x",
            _faster(over_bicycles, 1, of_eigenvalues.python_loop, bicycles, 300, repeats, solver),
        )  # fmt: skip
    count = 50_000 // few
    yield (
        "stacked numpy path against LAPACK's own time, 8 states", "<= 1.15",
        _slower(1.15, count, of_eigenvalues.lapack_itself, count, repeats),
    )  # fmt: skip
    count = 200_000 // few
    for path, solver in timing.SOLVERS.items():
        yield (
            f"2 threads against 1, {path}", ">= 1.7 x",
            _faster(1.7, count, of_eigenvalues.threads, count, solver, 5 * repeats),  # some calls meet a hiccup
        )  # fmt: skip
    yield (
        "2 threads against 1, hashing with SHA-256: what the machine gives", "",
        _faster(None, count, of_eigenvalues.threads_of_the_machine, count, 5 * repeats),
    )  # fmt: skip
    counts = [1000, 10_000, 100_000] + ([] if quick else [1_000_000])
    yield f"growth of time with points, 1000 to {counts[-1]}", "exponent <= 1.05", partial(_exponent, counts)
    yield f"memory of a {10 * points}-point sweep with reductions", "flat, < 500 MB", partial(_memory, 10 * points)
    count = 20_000 // few
    yield from _names(20_000 // (2 * few), repeats)
    for order in (8, 12):
        yield (
            f"gradients of all eigenvalues in all parameters, {order} states, against eigenvalues alone (numpy)",
            "<= 2.5", _slower(2.5, count, of_studies.gradients, count, order, repeats),
        )  # fmt: skip
    yield (
        f"dask.distributed, 2 workers, against 2 threads, {points} points", "<= 1.3",
        _slower(1.3, points, of_studies.cluster, points, min(repeats, 3)),
    )  # fmt: skip
    yield "stability chart of two boundaries of 200 points, 8 states", "<= 1 s", partial(_chart, repeats)
    yield "design with 3 varied parameters, 10 states", "<= 5 s, optimum confirmed", partial(_design, min(repeats, 3))


def _names(bicycles: int, repeats: int) -> Iterator[tuple[str, str, Measured]]:
    """Rows about named modes and critical speeds of so many bicycles."""
    yield from _batches(bicycles, repeats)
    for order in (8, 12):
        for path, solver in timing.SOLVERS.items():
            most = 1.5e-3 if (order, path) == (8, "fast") else None
            yield (
                f"all critical speeds of one bicycle, {order} states, against a 400-speed grid with polishing, {path}",
                ">= 3 x and <= 1.5 ms, none missed" if most else "faster, none missed",
                partial(_critical, order, solver, most, repeats),
            )  # fmt: skip


def _batches(bicycles: int, repeats: int) -> Iterator[tuple[str, str, Measured]]:
    """Rows about batches of named modes and critical speeds."""
    for path, least in (("fast", 15), ("numpy", 4)):
        solver = timing.SOLVERS[path]
        yield (
            f"named modes of {bicycles} bicycles, 8 states, 60 speeds, in batches ({path}) against one by one",
            f">= {least} x", partial(_batch, least, of_names.named_modes, 8, bicycles, solver, min(repeats, 3)),
        )  # fmt: skip
    fast = timing.SOLVERS["fast"]
    for order in (8, 12):
        yield (
            f"named critical speeds of {bicycles} bicycles, {order} states, in batches (fast) against one by one",
            ">= 12 x", partial(_batch, 12, of_names.many_critical_speeds, order, bicycles, fast, min(repeats, 3)),
        )  # fmt: skip
    for order in (8, 12):
        yield (
            f"the same, {order} states, as a sweep computes them on two cores: in batches on 2 threads", ">= 12 x",
            _faster(12, 1, of_names.critical_speeds_as_swept, order, bicycles, min(repeats, 3)),
        )  # fmt: skip
    points = 60 * bicycles
    yield (
        "named against unnamed eigenvalues, 8 states, 60 speeds, fast", "<= 4",
        _slower(4.0, points, of_names.named_against_unnamed, 8, bicycles, min(repeats, 3)),
    )  # fmt: skip
    yield (
        "2 threads against 1, named modes, fast", ">= 1.7 x",
        _faster(1.7, points, of_names.threads, 8, bicycles, min(repeats, 3)),
    )  # fmt: skip


def _batch(least: float, compare: Callable[..., tuple[float, float, int]], *arguments: Any) -> Row:
    one, many, left = compare(*arguments)
    return {
        "measured": f"{one / many:.3g} x", "met": one / many >= least, "seconds": (one, many),
        "note": f"{one * 1e6:.0f} and {many * 1e6:.0f} µs each; {left} bicycles left to the plain path",
    }  # fmt: skip


def _faster(least: float | None, count: int, compare: Callable[..., timing.Pair], *arguments: Any) -> Measured:
    """How many times faster the second side is, over ``count`` matrices."""

    def measured() -> Row:
        pair = compare(*arguments)
        ratio = pair[0] / pair[1]
        met = None if least is None else ratio >= least
        return {"measured": f"{ratio:.3g} x", "met": met, "note": _each(pair, count), "seconds": pair}

    return measured


def _slower(most: float, count: int, compare: Callable[..., timing.Pair], *arguments: Any) -> Measured:
    """How many times longer the second side takes."""

    def measured() -> Row:
        pair = compare(*arguments)
        ratio = pair[1] / pair[0]
        return {"measured": f"{ratio:.3g}", "met": ratio <= most, "note": _each(pair, count), "seconds": pair}

    return measured


def _each(pair: timing.Pair, count: int) -> str:
    return f"{pair[0] / count * 1e6:.3g} and {pair[1] / count * 1e6:.3g} µs each"


def _exponent(counts: list[int]) -> Row:
    exponent = of_studies.growth(counts)
    return {"measured": f"{exponent:.3f}", "met": exponent <= 1.05, "note": "8 states, 2 threads"}


def _chart(repeats: int) -> Row:
    found, taken = of_charts.chart(), of_charts.seconds(of_charts.chart, repeats)
    points = [len(curve) for curve in found.curves]
    agreed = int(found.check.apart.sum() - found.check.wrong.sum())
    note = f"{' and '.join(map(str, points))} points; count agrees at {agreed} of {found.check.apart.sum()} grid points"
    return {"measured": f"{taken:.2f} s", "met": taken <= 1 and min(points) >= 200, "note": note, "seconds": taken}


def _design(repeats: int) -> Row:
    found, taken = of_charts.design(), of_charts.seconds(of_charts.design, repeats)
    kept, points = of_charts.cheaper(found)
    note = f"{found.agreed[0]} of {found.agreed[1]} searches agree; of {points} cheaper grid points {kept} keep it"
    return {"measured": f"{taken:.2f} s", "met": taken <= 5 and not kept, "note": note, "seconds": taken}


def _memory(points: int) -> Row:
    (small, _), (large, seconds) = of_studies.peak_memory(points // 10), of_studies.peak_memory(points)
    flat = large < 1.1 * small + 20
    return {
        "measured": f"{large:.0f} MB", "met": flat and large < 500,
        "note": f"{small:.0f} MB with a tenth of the points; {seconds:.0f} s, 8 states, 2 threads",
    }  # fmt: skip


def _critical(order: int, solver: Solver, most: float | None, repeats: int) -> Row:
    grid, ours, on_grid, found = of_names.one_bicycle(order, solver, repeats)
    met = found >= on_grid and (grid > ours if most is None else ours <= most and grid >= 3 * ours)
    return {
        "measured": f"{grid / ours:.2f} x", "met": met, "seconds": (grid, ours),
        "note": f"{grid * 1e3:.1f} and {ours * 1e3:.2f} ms; {on_grid} crossings on the grid, {found} found and named",
    }  # fmt: skip


def markdown(result: dict[str, Any]) -> str:
    """The table of ``result`` as a page."""
    from tabulate import tabulate

    words = {True: "yes", False: "no", None: "-"}
    rows = [
        [row["figure"], row["target"] or "-", row["measured"] or "-", words[row["met"]], row["note"]]
        for row in result["rows"]
    ]
    machine = result["machine"]
    packages = ", ".join(f"{name} {machine[name]}" for name in ("numpy", "scipy", "numba", "BicycleParameters"))
    headers = ["figure", "target", "measured", "met", "each"]
    text = tabulate(rows, headers=headers, tablefmt="github", disable_numparse=True)
    quick = "\nA quick run with small sizes: indicative only.\n" if result["quick"] else ""
    return f"""# Benchmarks

Written by `velotyre validate speed --table docs/benchmarks.md`. Ratios are of medians of calls that take turns in one
run; `numpy` is the stacked LAPACK path, `fast` the compiled kernel (extra `fast`). Eigenvalues are computed on two
threads, names and critical speeds in batches on one where two are not said. One by one: bicycle after bicycle in one
process. The critical speeds of one bicycle are `fast` where `fast=True` asks for it.
{quick}
Machine: {machine["processor"]}, {machine["cores"]} cores, {machine["system"]}, Python {machine["python"]}, {packages};
load average at the start {machine["load"]} (other work on the machine spoils the ratios with threads).

{text}
"""
