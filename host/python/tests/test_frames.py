"""Data frames in and out: pandas, polars, pyarrow, a dict of columns; pictures; what can be pickled and copied."""

import copy
import pickle

import numpy as np
import pamtools as pam
from test_notebook import bench, everything, main, refused


def frame_columns(recording):
    """As a lab writes them: kPa and mm, whole numbers among them."""
    return {
        "time_s": recording.time,
        "pressure_kPa": recording.pressure / 1e3,
        "displacement_mm": recording.stroke * 1e3,
        "force_N": recording.force,
    }


def same(one, other):
    for name in ["time", "pressure", "stroke", "force"]:
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-12)


def test_frames_of_every_kind_become_the_same_recording():
    import pandas
    import polars
    import pyarrow

    muscle, campaign = everything()
    recording = campaign[0]
    columns = frame_columns(recording)
    for make in [dict, pandas.DataFrame, polars.DataFrame, pyarrow.table]:
        (read,) = pam.from_frame(make(columns), name="run 1", muscle=muscle)
        same(read, recording)
        assert read.name == "run 1"
    # Only the interface, of chunks, single precision, and missing values.
    chunks = pyarrow.chunked_array([columns["force_N"][:100].astype(np.float32), columns["force_N"][100:].astype(np.float32)])
    table = pyarrow.table({**columns, "force_N": chunks})
    only = type("Only", (), {"__arrow_c_stream__": lambda self, requested_schema=None: table.__arrow_c_stream__(requested_schema)})()
    (read,) = pam.from_frame(only, muscle=muscle)
    np.testing.assert_allclose(read.force, recording.force, rtol=1e-6, atol=1e-5)
    hole = pandas.DataFrame(columns)
    hole.loc[7, "force_N"] = np.nan
    error = refused(lambda: pam.from_frame(hole, "hole"))
    assert error.code == "recording::not-finite" and error.line == 8 and error.column == "force_N" and error.file == "hole", error
    (read,) = pam.from_frame(hole, missing="skip")
    assert len(read) == len(recording) - 1
    assert "no column" in str(refused(lambda: pam.from_frame({"time_s": [1.0]}))).lower()
    assert "not a data frame" in str(refused(lambda: pam.from_frame(3)))


def test_campaigns_go_out_and_come_back():
    import pandas
    import polars
    import pyarrow

    muscle, campaign = everything()
    for frame in [campaign.to_pandas(), campaign.to_polars(), pyarrow.table(campaign), polars.DataFrame(campaign)]:
        again = pam.from_frame(frame, muscle=muscle, split_by="recording")
        assert len(again) == len(campaign)
        for one, other in zip(again, campaign):
            same(one, other)
    one = campaign[0].to_pandas()
    assert isinstance(one, pandas.DataFrame) and list(one.columns)[:4] == ["time_s", "pressure_Pa", "displacement_m", "force_N"]
    assert isinstance(campaign[0].to_polars(), polars.DataFrame)


def test_a_frame_fits_as_its_file_does():
    muscle, campaign = everything()
    frame = campaign.to_polars()
    fit = pam.fit(pam.from_frame(frame, muscle=muscle, split_by="recording"), muscle)
    assert abs(fit.summary["blocked_force_N"] - pam.fit(campaign, muscle).summary["blocked_force_N"]) < 1e-6


def test_muscles_and_tables_are_pickled_copied_and_compared():
    muscle, campaign = everything()
    table = pam.fit(campaign, muscle).table
    for again in [pickle.loads(pickle.dumps(muscle)), copy.deepcopy(muscle)]:
        assert again == muscle and again.to_toml() == muscle.to_toml()
    assert muscle != pam.Muscle("other", 39.16, 77.4, 3.0, 0.5)
    assert pickle.loads(pickle.dumps(table)).force(3e5, 1e-3) == table.force(3e5, 1e-3)


def test_everything_can_be_drawn():
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    muscle, campaign = everything()
    fit = pam.fit(campaign, muscle)
    assert [len(ax.lines) for ax in campaign[0].plot()] == [1, 1, 1]
    assert len(campaign.plot().lines) == len(campaign)
    assert len(fit.plot().lines) == 2 * len(campaign)
    assert len(fit.table.plot().lines) == len(fit.table.nodes)
    (prediction,) = fit.table.predict_with_bands(pam.Campaign([campaign[0]]))
    _, ax = plt.subplots()
    assert prediction.plot(ax) is ax and ax.collections, "the band is drawn"
    plt.close("all")


if __name__ == "__main__":
    main(globals())
