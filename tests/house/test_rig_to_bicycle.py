"""From rig recordings to critical speeds as a user goes: simulate (synthetic), fit, name the table in a model file."""

import csv
import json

import pytest

from studies.cli import main

SMALL = ["--loads", "340,490", "--pressures", "5.5,7.5", "--rates", "2", "--pulls", "1"]
PER_RADIAN = 57.29577951308232


def test_a_fitted_tyre_is_named_in_a_model_file(tmp_path, capsys):
    main(["tyre", "simulate", str(tmp_path / "rig"), "--seed", "4", *SMALL])
    main(["tyre", "fit", str(tmp_path / "rig"), "--out", str(tmp_path / "fit"), "--jobs", "1"])
    (table,) = (tmp_path / "fit" / "maps").glob("*.csv")
    said = capsys.readouterr().out
    assert f'tyre = "{table.as_posix()}"' in said
    model = tmp_path / "model.toml"
    model.write_text(
        'bicycle = "pista_charlie_drops"\n[effects.relaxation_length]\n'
        f'tyre = "fit/maps/{table.name}"\npressure_bar = 5.5\n'
    )
    main(["critical", str(model), "--json", str(tmp_path / "critical.json")])
    out = capsys.readouterr()
    assert "synthetic" in out.out + out.err
    found = json.loads((tmp_path / "critical.json").read_text())
    assert {"weave", "capsize"} <= {c["mode"] for c in found["critical_speeds"]}

    main(["sweep", str(_sweep(tmp_path)), "--out", str(tmp_path / "r.zarr")])
    import xarray as xr

    with xr.open_zarr(tmp_path / "r.zarr", consolidated=False) as opened:
        key = "relaxation_length.cornering_stiffness.front"
        stiffness = opened.parameters.sel(parameter=key).values
    with table.open() as stream:
        rows = [r for r in csv.DictReader(stream) if float(r["pressure_bar"]) == 5.5]
    fitted = [float(r["cornering_stiffness_N_per_deg"]) * PER_RADIAN for r in rows]  # at 340 and 490 N
    assert stiffness == pytest.approx(fitted, rel=1e-9)


def _sweep(folder):
    """At the loads that were measured, so that the fitted values themselves must come back."""
    file = folder / "sweep.toml"
    file.write_text('model = "model.toml"\noutputs = ["parameters"]\n[grid]\nload_N = [340.0, 490.0]\n')
    return file
