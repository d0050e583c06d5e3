"""The Python environment of the compared programs: created once under target/ and used by every benchmark."""

import os
import subprocess
import sys
import venv
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PLACE = ROOT / "target" / "benchmarks-python"


def enter() -> None:
    """Restarts the script in an environment with the packages of requirements.txt, created in the first call."""
    python = PLACE / "bin" / "python"
    if Path(sys.prefix) == PLACE:
        return
    wanted = HERE / "requirements.txt"
    done = PLACE / "requirements.txt"
    if not done.exists() or done.read_text() != wanted.read_text():
        venv.create(PLACE, with_pip=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", "-r", wanted], check=True)
        done.write_text(wanted.read_text())
    os.execv(python, [str(python), *sys.argv])


def built(*targets: str) -> Path:
    """Builds targets of the workspace in release mode, all programs if none are given. Returns their folder."""
    subprocess.run(["cargo", "build", "--release", "--quiet", "--workspace", *(targets or ("--bins",))], cwd=ROOT, check=True)
    return Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release"
