"""The job of examples/fleet on the local executors of Dask and Ray: the results are those of `host batch`."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import pyarrow.parquet

ROOT = pathlib.Path(__file__).resolve().parents[3]


def manifest(folder, bench, count):
    """Muscles of one bench whose recordings differ, and one without recordings."""
    rows = ["muscle,description,files"]
    for i in range(count):
        own = folder / f"m{i}"
        own.mkdir()
        shutil.copy(bench / "muscle.toml", own)
        recordings = sorted(p for p in bench.glob("*.csv"))
        # Each muscle lacks the last rows of its recordings, so that no two tables are equal.
        for path in recordings:
            lines = path.read_text().splitlines(keepends=True)
            (own / path.name).write_text("".join(lines[: len(lines) - 20 * i]))
        rows.append(f"mini-{i},m{i}/muscle.toml,m{i}/*Pa.csv")
    rows.append(f"mini-{count},m0/muscle.toml,none.csv")
    (folder / "fleet.csv").write_text("\n".join(rows) + "\n")


def rows(path):
    return pyarrow.parquet.read_table(path).to_pylist()


def main(bench):
    with tempfile.TemporaryDirectory() as work:
        folder = pathlib.Path(work)
        manifest(folder, pathlib.Path(bench), 3)
        environment = {**os.environ, "RAY_USAGE_STATS_ENABLED": "0", "DASK_DISTRIBUTED__WORKER__MEMORY__TERMINATE": "False"}
        subprocess.run([os.environ["PAM_HOST"], "batch", "fleet.csv", "-o", "batch", "--only", "fit", "--quiet"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        whole = {r["muscle"]: r for p in sorted((folder / "batch").glob("*/fits.parquet")) for r in rows(p)}
        assert len(whole) == 3 and len({r["deadband_kPa"] for r in whole.values()}) == 3, whole
        for engine in ("dask", "ray"):
            script = ROOT / "examples" / "fleet" / f"fleet_{engine}.py"
            subprocess.run([sys.executable, script, "fleet.csv", engine], cwd=folder, check=True, env=environment, timeout=600)
            fits = rows(folder / engine / "fits.parquet")
            assert [r["muscle"] for r in fits] == ["mini-0", "mini-1", "mini-2"], fits
            for fit in fits:
                for name in ("deadband_kPa", "blocked_force_N", "rms_N", "mean_error_pct"):
                    assert fit[name] == whole[fit["muscle"]][name], (engine, name, fit)
            failures = rows(folder / engine / "failures.parquet")
            assert [r["muscle"] for r in failures] == ["mini-3"] and failures[0]["code"] == "file::unreadable", failures
            print(f"fleet on {engine}: 3 muscles as by host batch, 1 failure listed")


if __name__ == "__main__":
    main(sys.argv[1])
