"""One muscle through the Python bindings: what Dask and Ray run many times.

The manifest is that of `host batch` (muscle, description, files). Rows are plain dictionaries, which both engines send between processes.
"""

import csv
import glob
import pathlib

import pamtools


def muscles(manifest):
    """The rows of a manifest, with paths relative to its folder."""
    folder = pathlib.Path(manifest).parent
    with open(manifest, newline="", encoding="utf-8") as text:
        for row in csv.DictReader(text):
            patterns = [p.strip() for p in row["files"].split(";")]
            files = [f for p in patterns for f in (sorted(glob.glob(str(folder / p))) or [str(folder / p)])]
            yield {"muscle": row["muscle"], "description": str(folder / row["description"]), "files": files}


def analyse(item):
    """A row for `fits`, or a row for `failures`: one muscle never stops the others."""
    try:
        muscle = pamtools.Muscle.read(item["description"])
        fit = pamtools.fit(pamtools.read(item["files"], muscle), muscle)
    except pamtools.PamError as error:
        return {"muscle": item["muscle"], "code": error.code, "cause": error.cause, "remedy": error.help}
    keep = ("samples", "deadband_kPa", "deadband_std_kPa", "blocked_force_N", "rms_N", "mean_error_pct", "max_error_pct")
    return {"muscle": item["muscle"], **{name: fit.summary[name] for name in keep}}


def write(rows, folder):
    """Two Parquet tables, `fits` and `failures`."""
    import pyarrow
    import pyarrow.parquet

    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name, chosen in (("fits", [r for r in rows if "code" not in r]), ("failures", [r for r in rows if "code" in r])):
        if chosen:
            pyarrow.parquet.write_table(pyarrow.Table.from_pylist(chosen), folder / f"{name}.parquet")
