#!/usr/bin/env python3
"""Other people's methods on the recordings of a sealed set, compared with the answers of `host diagnose`.

    python3 -m venv .venv && .venv/bin/pip install -r tests/trials/requirements.txt
    cargo run --release -p trials -- generate --set dev --n 345 --seed 20261129 -o DEVELOPMENT    (then `answer`, `score`)
    cargo run --release -p trials -- generate --set dev --n 2000 --seed 7 -o TRAINING
    .venv/bin/python tests/trials/baselines.py DIR --development DEVELOPMENT --training TRAINING

DIR and DEVELOPMENT are answered and scored. Writes DIR/guesses.json, which `trials score DIR` puts into the report. The methods, each
described at the head of its file in tests/trials/methods:

  sparse       PySINDy's thresholded least squares on the catalogue's compact equations
  knockoffs    knockpy on the same equations
  discrepancy  emdcmp on the same equations
  classifier   gradient boosting, trained on the bench (TRAINING)
  process      a Gaussian process as discrepancy of a plain table: its error on held-out recordings

Each method that names has one or two settings, which is chosen on DEVELOPMENT: most classes right there among the settings that name at most 2 % of
the trials without an effect. Names are given for the trials that naming is judged on, and for those without an effect.
"""

import argparse
import json
import os
import warnings
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

# Small problems: threads only wait for each other.
for library in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(library, "1")
warnings.filterwarnings("ignore")

import numpy as np

from methods import classifier, discrepancy, knockoffs, process, sparse
from methods.recordings import Columns, read

FALSE_ALARMS = 0.02
# A trial is visible as in src/score.rs: a stiff base leaves half a noise deviation of the effect.
VISIBLE = 0.5


class Trial:
    def __init__(self, directory, id, outcome=None):
        self.id, self.directory = f"{id:04}", directory
        self.truth = json.loads((directory / "sealed" / self.id / "truth.json").read_text())
        self.stratum = self.truth["stratum"]
        self.is_null = self.stratum.startswith("null")
        self.outcome = outcome
        self.rest_length = self.truth["bench"]["muscle"]["geometry"]["rest_length"]
        self.effect = self.truth["effects"][0]["name"] if self.truth["effects"] else ""
        self.campaign = sorted((directory / "trials" / self.id).glob("*.csv"))

    def is_visible(self):
        return any(e["left_stiff_N"] >= VISIBLE * self.truth["noise_N"] for e in self.truth["effects"])

    def is_judged(self):
        return self.stratum in ("single", "decoy") and self.outcome["visible"] and self.outcome["amplitude_pct"] >= 2.0


METHODS = {"sparse": sparse, "knockoffs": knockoffs, "discrepancy": discrepancy, "classifier": classifier}


def evidence(trial):
    """The evidence of the methods that need no training, by method; for the classifier its features."""
    files = [read(f) for f in trial.campaign]
    columns = Columns(files, trial.rest_length)
    found = {key: METHODS[key].evidence(columns) for key in ("sparse", "knockoffs", "discrepancy")}
    return {**found, "classifier": classifier.features(files, columns, trial.rest_length)}


def features(trial):
    files = [read(f) for f in trial.campaign]
    return classifier.features(files, Columns(files, trial.rest_length), trial.rest_length)


def scored(directory):
    """Trials that names are given for, and the class of each effect."""
    report = json.loads((directory / "report.json").read_text())
    trials = [Trial(directory, t["outcome"]["id"], t["outcome"]) for t in report["trials"]]
    return [t for t in trials if t.is_null or t.is_judged()], report


def chosen(method, trials, found, classes, careful):
    """The setting with most classes right; a careful one keeps to the bound of false alarms as far as possible."""
    class_of = lambda name: classes.get(name, name)

    def rank(setting):
        names = [method.name(f, setting) for f in found]
        alarms = np.mean([n != "" for n, t in zip(names, trials) if t.is_null])
        right = np.mean([class_of(n) == class_of(t.effect) for n, t in zip(names, trials) if not t.is_null])
        return min(0.0, FALSE_ALARMS - float(alarms)) if careful else 0.0, float(right)

    return max(method.SETTINGS, key=rank)


def held_out_errors(directory, report, host, most):
    """Errors of the Gaussian process where a gain is possible, N."""
    errors = {}
    for t in report["trials"]:
        outcome, held = t["outcome"], t["held_out"]
        if len(errors) >= most or outcome["stratum"] not in ("single", "decoy") or not outcome["visible"] or held is None:
            continue
        if held["plain_N"] - held["twin_N"] > 0.5 * held["twin_N"]:
            trial = Trial(directory, outcome["id"], outcome)
            held_out = sorted((directory / "sealed" / trial.id / "held_out").glob("*.csv"))
            error = process.held_out_error(host, directory / "work" / trial.id, trial.campaign, held_out, trial.rest_length)
            if error is not None:
                errors[trial.id] = error
    return errors


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("set", type=Path)
    arguments.add_argument("--development", type=Path, required=True, help="an answered and scored development set")
    arguments.add_argument("--training", type=Path, required=True, help="a generated set for the classifier")
    arguments.add_argument("--host", default="target/release/host")
    arguments.add_argument("--most", type=int, default=60, help="most trials for the Gaussian process")
    a = arguments.parse_args()
    trials, report = scored(a.set)
    development, _ = scored(a.development)
    training = [Trial(a.training, int(p.name)) for p in sorted((a.training / "sealed").iterdir()) if p.is_dir()]
    training = [t for t in training if t.is_null or t.stratum in ("single", "decoy")]
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        found, tuning = list(pool.map(evidence, trials)), list(pool.map(evidence, development))
        x = np.array(list(pool.map(features, training, chunksize=8)))
    trained = classifier.Classifier(x, [t.effect if t.is_visible() else "" for t in training])
    for rows in (found, tuning):
        for row, chances in zip(rows, trained.evidence(np.array([r["classifier"] for r in rows]))):
            row["classifier"] = chances
    methods = []
    for key, method in METHODS.items():
        for careful in (False, True):
            setting = chosen(method, development, [row[key] for row in tuning], report["classes"], careful)
            names = {t.id: method.name(row[key], setting) for t, row in zip(trials, found)}
            label = f"{method.LABEL}, {'few false alarms' if careful else 'most right'}"
            methods.append({"method": label, "names": names})
            print(f"{label}: setting {setting}, {sum(n != '' for n in names.values())} of {len(names)} trials named")
    guesses = {"methods": methods, "training": len(training), "development": len(development),
               "gp_N": held_out_errors(a.set, report, a.host, a.most), "gp": process.LABEL}
    (a.set / "guesses.json").write_text(json.dumps(guesses, indent=1) + "\n")
    print(f"{len(guesses['gp_N'])} Gaussian processes: {a.set / 'guesses.json'}")


if __name__ == "__main__":
    main()
