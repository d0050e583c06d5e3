"""The notebook of the book, cell by cell, on recordings of the virtual bench.

    python -m pytest host/python/tests      # or: python host/python/tests/test_notebook.py BENCH_FOLDER

BENCH_FOLDER is made by `virtual-bench record --muscle mini --protocol thesis -o BENCH_FOLDER`; the environment variable
PAM_BENCH names it for pytest.
"""

import ast
import os
import pathlib
import pickle
import sys
import tempfile
import warnings

import numpy as np
import pamtools as pam


def bench():
    folder = pathlib.Path(os.environ.get("PAM_BENCH", "bench"))
    assert (folder / "muscle.toml").exists(), f"no recordings in {folder}; see the head of this file"
    return folder


def everything():
    folder = bench()
    muscle = pam.Muscle.read(folder / "muscle.toml")
    return muscle, pam.read(sorted(folder.glob("*.csv")), muscle)


def test_recordings_are_arrays_in_si():
    muscle, campaign = everything()
    first = campaign.recordings[0]
    assert isinstance(first.force, np.ndarray) and first.force.dtype == np.float64
    assert len(first) == first.time.size == first.pressure.size
    assert np.all(np.diff(first.time) > 0)
    assert 1e5 < np.median(first.pressure) < 1e6, "pascals"
    assert first.stroke.max() < 0.2 * muscle.rest_length, "metres"
    assert [r.name for r in campaign] == [r.name for r in campaign.recordings]
    assert campaign[-1].name == campaign.recordings[-1].name
    for beyond in [len(campaign), -len(campaign) - 1]:
        try:
            campaign[beyond]
        except IndexError as error:
            assert str(len(campaign)) in str(error)
        else:
            raise AssertionError(f"recording {beyond} was given")


def test_a_fit_predicts_a_pressure_it_has_not_seen():
    muscle, campaign = everything()
    seen = pam.Campaign([r for i, r in enumerate(campaign.recordings) if i != 2])
    fit = pam.fit(seen, muscle)
    unseen = campaign.recordings[2]
    (model,) = fit.table.predict(pam.Campaign([unseen]))
    rms = np.sqrt(np.mean((unseen.force - model) ** 2))
    assert rms < 0.02 * fit.summary["blocked_force_N"], rms
    assert 6e4 < fit.table.deadband < 9e4
    assert fit.summary["schema"] == "pam-fit/1"


def test_a_prediction_says_how_sure_it_is():
    muscle, campaign = everything()
    table = pam.fit(campaign, muscle).table
    plain, banded = table.predict(campaign), table.predict_with_bands(campaign)
    for recording, force, one in zip(campaign.recordings, plain, banded):
        np.testing.assert_array_equal(one.force, force)
        assert one.band.shape == force.shape and np.all(one.band > 0) and np.all(one.band < 2)
        assert abs(one.rms - np.sqrt(np.mean((recording.force - force) ** 2))) < 1e-9
        assert 0.8 < one.inside <= 1, "most readings lie inside their band"
    # Without force there is nothing to compare with, and the bands stay.
    blind = campaign.recordings[0]
    blind = pam.Recording("blind", blind.time, blind.pressure, blind.stroke)
    (one,) = table.predict_with_bands(pam.Campaign([blind]))
    assert one.rms is None and one.inside is None and len(one.band) == len(blind)
    # About the mid-line the band is that of the numbers, without readings.
    assert table.force_band(300e3, 1e-4) > 0


def test_arrays_are_taken_as_numpy_takes_them():
    muscle, campaign = everything()
    table = pam.fit(campaign, muscle).table
    assert len(pam.read(bench() / "01_205kPa.csv", muscle)) == 1, "one path is as good as a list of one"
    one = table.force(300e3, 1e-3)
    assert isinstance(one, float) and one > 0
    pressures = np.array([[200_000], [300_000]])  # whole numbers, and two dimensions
    grid = table.force(pressures, np.linspace(0, 1e-3, 7, dtype=np.float32), direction=[1] * 7)
    assert grid.shape == (2, 7) and grid.dtype == np.float64
    np.testing.assert_allclose(table.force(300e3, np.linspace(0, 1e-3, 7)[::2])[0], table.force(300e3, 0.0))
    r = campaign.recordings[0]
    listed = pam.Recording("listed", list(r.time), r.pressure.astype(np.float32), r.stroke[:], r.force)
    assert len(listed) == len(r) and listed.pressure.dtype == np.float64


def test_the_table_is_evaluated_kept_and_read_back():
    muscle, campaign = everything()
    table = pam.fit(campaign, muscle).table
    stroke = np.linspace(0, 0.04 * muscle.rest_length, 50)
    shortening, lengthening = (table.force(np.full(50, 400e3), stroke, d) for d in (1, -1))
    assert np.all(shortening < lengthening), "friction opposes motion"
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "mini.pam")
        table.write(path)
        again = pam.Table.read(path)
        np.testing.assert_array_equal(again.force(np.full(50, 400e3), stroke, 1), shortening)


def test_a_force_outside_the_braid_is_refused_and_one_outside_the_recordings_is_reported():
    muscle, campaign = everything()
    table = pam.fit(campaign, muscle).table
    # Shortened by three quarters, and pulled beyond its fibres' length: the equations would give −10⁸ N, and not a word.
    for stroke in [0.75 * muscle.rest_length, -0.2 * muscle.rest_length]:
        for ask in [table.force, table.force_band]:
            error = refused(lambda: ask(3e5, [1e-3, stroke]))
            assert error.code == "recording::out-of-range" and "outside the range of this braid" in str(error), error
    assert "outside the range of pneumatic muscles" in str(refused(lambda: table.force(3e11, 1e-3)))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        table.force(3e5, 1e-3)
        assert not said
        table.force(9e5, 1e-3)
        assert "outside the pressures" in str(said[0].message), said


def test_own_arrays_become_a_recording():
    muscle, campaign = everything()
    r = campaign.recordings[0]
    own = pam.Recording("own", r.time, r.pressure, r.stroke, r.force)
    np.testing.assert_array_equal(own.force, r.force)
    fit = pam.fit(pam.Campaign([own]), muscle)
    assert fit.summary["samples"] == len(r)


def test_what_is_wrong_is_said():
    time = np.arange(20.0)
    try:
        pam.Recording("back", time[::-1].copy(), time, time)
    except pam.PamError as error:
        assert error.code == "recording::time-order"
        assert error.cause in str(error) and error.help in str(error)
    else:
        raise AssertionError("time that goes backwards was taken")
    try:
        pam.Muscle("m", -1.0, 77.4, 3.0, 0.5)
    except ValueError as error:
        assert "rest_length_mm" in str(error)
    else:
        raise AssertionError("a negative length was taken")
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "bad.csv")
        with open(path, "w", encoding="utf-8") as file:
            file.write("time_s,pressure_kPa,displacement_mm,force_N\n0,300,0,50\n1,300,0,5o\n")
        error = refused(lambda: pam.read([path]))
        assert (error.code, error.file, error.line, error.column) == ("recording::not-a-number", path, 3, "force_N")
        assert refused(lambda: pam.read([folder + "/none.csv"])).code == "file::unreadable"
        assert "a recording, not a table" in str(refused(lambda: pam.Table.read(path)))
    two = np.zeros((20, 2))
    assert "2 dimensions" in str(refused(lambda: pam.Recording("two", two, time, time)))
    assert "not an array of numbers" in str(refused(lambda: pam.Recording("text", ["a", "b"], time, time)))
    muscle, campaign = everything()
    table = pam.fit(campaign, muscle).table
    assert "do not fit each other" in str(refused(lambda: table.force(np.zeros(3), np.zeros(4))))
    assert "between 1 and 6" in str(refused(lambda: pam.fit(campaign, muscle, order=9)))


def refused(act):
    """What is raised, which must be the package's own."""
    try:
        act()
    except pam.PamError as error:
        assert error.help and error.cause
        return error
    raise AssertionError("it was taken")


def test_wrong_arrays_and_options_are_refused_by_name():
    muscle, campaign = everything()
    time, pressure, stroke, force = np.arange(100) * 0.01, np.full(100, 3e5), np.linspace(0, 1e-3, 100), np.linspace(50, 20, 100)
    hole = force.copy()
    hole[7] = np.nan
    error = refused(lambda: pam.Recording("a", time, pressure, stroke, hole))
    assert "row 8" in str(error) and "recording `a`" in str(error), error
    assert "complex" in str(refused(lambda: pam.Recording("a", time, pressure, stroke, force + 1j)))
    assert "time does not increase" in str(refused(lambda: pam.Recording("a", time[::-1], pressure, stroke, force)))
    assert "50 rows" in str(refused(lambda: pam.Recording("a", time, pressure, stroke[:50], force)))
    assert "0 rows" in str(refused(lambda: pam.fit(pam.Campaign([]), muscle)))
    assert "`order` is -1" in str(refused(lambda: pam.fit(campaign, muscle, order=-1)))
    table = pam.fit(campaign, muscle).table
    assert "`direction` is 5" in str(refused(lambda: table.force(3e5, stroke, direction=5)))
    assert "muscle's description" in str(refused(lambda: pam.read(bench() / "muscle.toml")))


def test_the_listing_of_the_book_runs():
    page = pathlib.Path(__file__).resolve().parents[3] / "docs/src/python.md"
    listing = page.read_text(encoding="utf-8").split("```python\n")[1].split("```")[0]
    folder, here = bench().resolve(), os.getcwd()
    with tempfile.TemporaryDirectory() as work:
        os.symlink(folder, os.path.join(work, "bench"))
        os.chdir(work)
        try:
            names = {}
            exec(compile(listing, str(page), "exec"), names)
            assert names["force"].shape == (50,) and os.path.getsize("mini.pam") > 0 and os.path.getsize("fit.html") > 0
        finally:
            os.chdir(here)


def test_stubs_and_help_name_what_there_is():
    stubs = ast.parse((pathlib.Path(__file__).parent.parent / "python/pamtools/_native.pyi").read_text())
    public = lambda names: {n for n in names if not n.startswith("_")}
    documented = {}
    for node in stubs.body:
        if isinstance(node, ast.ClassDef):
            documented[node.name] = public(n.name for n in node.body if isinstance(n, ast.FunctionDef))
        elif isinstance(node, ast.FunctionDef):
            documented[node.name] = set()
    native = pam.fit.__module__ and __import__("pamtools._native", fromlist=["_native"])
    assert public(vars(native)) == set(documented)
    for name, members in documented.items():
        thing = getattr(native, name)
        assert thing.__doc__, f"{name} has no docstring"
        if name not in {"PamError"} and isinstance(thing, type):
            assert public(vars(thing)) == members, name
            assert all(getattr(thing, m).__doc__ for m in members), name
    for name in pam.__all__:
        thing = getattr(pam, name)
        assert thing.__doc__, f"{name} has no docstring"
        if isinstance(thing, type) and thing.__module__ != "pamtools._native":
            assert all(getattr(thing, m).__doc__ for m in public(vars(thing))), name


def test_a_diagnosis_is_a_dict_and_a_report():
    muscle, campaign = everything()
    with tempfile.TemporaryDirectory() as folder:
        report = os.path.join(folder, "why.html")
        answer = pam.diagnose(campaign, muscle, report=report)
        assert answer["schema"] == "pam-diagnose/1"
        assert answer["verdict"] in {"consistent", "explained", "partly-explained", "unexplained"}
        assert open(report, encoding="utf-8").read().startswith("<!DOCTYPE html>")
        assert pickle.loads(pickle.dumps(answer)) == answer


def test_a_diagnosis_gives_the_corrected_table():
    muscle, campaign = everything()
    # A load cell that reads 8 % too much.
    late = [pam.Recording(r.name, r.time, r.pressure, r.stroke, r.force * 1.08) for r in campaign]
    answer = pam.diagnose(pam.Campaign(late), muscle)
    corrected = answer.corrected_table()
    assert isinstance(corrected, pam.Table)
    predicted = corrected.predict(pam.Campaign(late))
    rms = np.sqrt(np.mean(np.concatenate([r.force - f for r, f in zip(late, predicted)]) ** 2))
    assert rms < 1.0, rms


def test_the_examples_in_the_docstrings_hold():
    import doctest
    import importlib

    found = 0
    for name in ["pamtools", "pamtools.device", "pamtools.diagnosis", "pamtools.plots", "pamtools.regression"]:
        result = doctest.testmod(importlib.import_module(name), raise_on_error=False)
        assert result.failed == 0, name
        found += result.attempted
    page = pathlib.Path(__file__).resolve().parents[3] / "docs/src/python.md"
    here = os.getcwd()
    with tempfile.TemporaryDirectory() as work:
        os.symlink(bench().resolve(), os.path.join(work, "bench"))
        os.chdir(work)
        try:
            blocks = [part.split("```")[0] for part in page.read_text(encoding="utf-8").split("```pycon\n")[1:]]
            examples = doctest.DocTestParser().get_doctest("\n".join(blocks), {}, page.name, str(page), 0)
            runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
            runner.run(examples)
            result = runner.summarize()
        finally:
            os.chdir(here)
    assert result.failed == 0
    assert found + result.attempted >= 15, "the page has examples"


def main(names):
    """Runs every test of a module; the first argument of the call names the folder of recordings."""
    if len(sys.argv) > 1:
        os.environ["PAM_BENCH"] = sys.argv[1]
    for name, test in list(names.items()):
        if name.startswith("test_"):
            test()
            print(name, "ok", flush=True)


if __name__ == "__main__":
    main(globals())
