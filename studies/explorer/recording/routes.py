"""The addresses of the page of recordings: the page, files in, a computation, what it found, files out."""

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from flask import Flask, Response, request, send_file

from bicycle.effect import registry
from bicycle.effect.registry import outside_origins
from bicycle.modal.known_modes import known_modes
from studies.explorer.guard import FOLDER, said
from studies.explorer.recording.asked import channel_map, command_of
from studies.explorer.recording.desk import CHANNELS, LARGEST_FILE, Desk, Desks
from studies.explorer.recording.jobs import Busy, Jobs
from studies.explorer.recording.mounted import mounted
from studies.explorer.recording.names import RESULTS
from studies.explorer.recording.sidecar import described
from studies.explorer.recording.tyre_options import tyre_options
from studies.look.roles import QUANTITIES
from studies.missing_effect.packaged import available_measurements
from studies.reporting.markdown_text import html_template
from tyre.base.errors import InputError
from tyre.channels.units import SI

SHOWN = (".png", ".svg")  # of what a command wrote, in the page; everything else is only downloaded
MOST_CHANNELS = 200  # rows of a channel map


def add_routes(server: Flask) -> Callable[[], None]:
    """Add the page of recordings to a server.

    Parameters
    ----------
    server : flask.Flask

    Returns
    -------
    callable
        Ends what runs and deletes what was loaded.
    """
    desks, jobs = Desks(), Jobs()
    _page(server)
    _files(server, desks, jobs)
    _computations(server, desks, jobs)
    _results(server, desks)

    def close() -> None:
        jobs.close()
        desks.close()

    return close


def _page(server: Flask) -> None:
    template = Path(__file__).parents[1] / "templates" / "recording.html.j2"
    page = html_template(template.read_text(encoding="utf-8"))
    units = {"time": "s"} | {name: SI[quantity] for name, quantity in QUANTITIES.items()}

    @server.get("/recording")
    def recording_page() -> str:
        filled: str = page.render(
            measurements=available_measurements(), modes=list(known_modes()), effects=sorted(registry()),
            largest=LARGEST_FILE, channels=list(units), units=units, map_name=CHANNELS, tyre_options=tyre_options(),
        )  # fmt: skip
        return filled


def _files(server: Flask, desks: Desks, jobs: Jobs) -> None:
    @server.post(f"{FOLDER}open")
    def open_desk() -> Response:
        jobs.prepare()
        return _json({"desk": desks.open(spare=jobs.running).token})

    @server.post(f"{FOLDER}<token>/file/<path:name>")
    def load(token: str, name: str) -> Response:
        desk = _desk(desks, token)
        _idle(jobs, desk)
        desk.load(name, request.stream, request.content_length or 0)
        return _json({"files": desk.files()})

    @server.post(f"{FOLDER}<token>/remove")
    def remove(token: str) -> Response:
        desk, name = _desk(desks, token), _body().get("name")
        _idle(jobs, desk)
        if isinstance(name, str):
            desk.remove(name)
        return _json({"files": desk.files()})

    @server.post(f"{FOLDER}<token>/keep")
    def keep(token: str) -> Response:
        """Take a file that a command wrote among those that are loaded."""
        desk, name = _desk(desks, token), _body().get("name")
        _idle(jobs, desk)
        found = desk.file(name) if isinstance(name, str) else None
        if found is None:
            raise InputError("there is no such file; compute it again")
        with found.open("rb") as content:
            desk.load(found.name, content, found.stat().st_size)
        return _json({"files": desk.files()})

    @server.post(f"{FOLDER}<token>/mount")
    def mount(token: str) -> Response:
        """Put a fitted tyre on the bicycle of the model page."""
        desk, asked = _desk(desks, token), _body()
        return _json({"address": mounted(desk, asked.get("name"), asked.get("model"))})

    @server.post(f"{FOLDER}<token>/describe")
    def describe(token: str) -> Response:
        """Keep the sidecar of a recording, made of a draft and what the user knows."""
        desk = _desk(desks, token)
        _idle(jobs, desk)
        name, text = described(desk, _body())
        desk.make(name, text)
        return _json({"files": desk.files(), "name": name})

    @server.post(f"{FOLDER}<token>/map")
    def fill_map(token: str) -> Response:
        desk, rows = _desk(desks, token), _body().get("rows")
        _idle(jobs, desk)
        if not isinstance(rows, list) or len(rows) > MOST_CHANNELS or not all(isinstance(row, dict) for row in rows):
            raise InputError(f"channels: must be at most {MOST_CHANNELS} rows")
        desk.make(CHANNELS, channel_map(rows))
        return _json({"files": desk.files(), "map": CHANNELS})


def _computations(server: Flask, desks: Desks, jobs: Jobs) -> None:
    @server.post(f"{FOLDER}<token>/run")
    def run(token: str) -> Response:
        desk, asked = _desk(desks, token), dict(_body())
        kind = asked.pop("kind", "")
        arguments = command_of(desk, kind if isinstance(kind, str) else "", asked)
        own = [f"--effects={Path(origin.file).resolve()}" for origin in outside_origins() if origin.file]
        try:
            return _json(jobs.start(desk, kind, [*own, *arguments]).told(), 202)
        except Busy as error:
            return Response(str(error), status=409, mimetype="text/plain")

    @server.post(f"{FOLDER}cancel")
    def cancel() -> Response:
        jobs.cancel()
        return _json({})

    @server.get(f"{FOLDER}<token>/state")
    def state(token: str) -> Response:
        desk = _desk(desks, token)
        job = jobs.of(desk)
        told = None if job is None else job.told()
        return _json({"files": desk.files(), "job": told, "results": sorted(desk.results)})


def _results(server: Flask, desks: Desks) -> None:
    @server.get(f"{FOLDER}<token>/result/<kind>")
    def result(token: str, kind: str) -> Response:
        desk = _desk(desks, token)
        if kind not in desk.results:
            return said(404, "there is no such result")
        return _json(desk.results[kind] | {"files": desk.written(kind)})

    @server.get(f"{FOLDER}<token>/out/<path:name>")
    def out(token: str, name: str) -> Response:
        desk = _desk(desks, token)
        found = desk.file(name) if name.partition("/")[0] in RESULTS or name in desk.made else None
        if found is None:
            return said(404, "there is no such file")
        shown = found.suffix in SHOWN
        return send_file(found, as_attachment=not shown, download_name=found.name, max_age=0)

    @server.get(f"{FOLDER}<token>/zip/<kind>")
    def everything(token: str, kind: str) -> Response:
        desk = _desk(desks, token)
        names = [str(one["name"]) for one in desk.written(kind)] if kind in desk.results else []
        if not names:
            return said(404, "there is no such result")
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as opened:
            for name in names:
                opened.write(desk.folder / kind / name, f"{kind}/{name}")
        packed.seek(0)
        return send_file(packed, "application/zip", as_attachment=True, download_name=f"velotyre_{kind}.zip", max_age=0)


def _desk(desks: Desks, token: str) -> Desk:
    desk = desks.find(token)
    if desk is None:
        raise InputError("the files of this page are no longer kept; load the page and the files again")
    return desk


def _idle(jobs: Jobs, desk: Desk) -> None:
    """Files stay as they are while a computation reads them."""
    job = jobs.of(desk)
    if job is not None and job.state == "running":
        raise InputError("a computation is reading these files; wait for its end, or cancel it")


def _body() -> dict[str, Any]:
    try:
        found = request.get_json(silent=True)
    except RecursionError:
        found = None
    if not isinstance(found, dict):
        raise InputError("this is no request of the page")
    return found


def _json(content: Any, code: int = 200) -> Response:
    return Response(json.dumps(content), status=code, mimetype="application/json")
