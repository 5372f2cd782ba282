"""A run read from an exported file by another program has the same numbers."""

import csv
import io
import json
import math
import re
import sys
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pyarrow.parquet
import pytest
from PIL import Image

from slipgrasp.core.run.premises import PremisesError, find_premises
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.frames import MissingPackageError
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.figures.animation import MAX_FRAMES, frame_times, write_gif
from slipgrasp.figures.film import write_mp4, write_webm
from slipgrasp.figures.still import write_png, write_svg
from slipgrasp.recordings.clip import Clip, ClipError
from slipgrasp.recordings.export import (
    EXPORT_FORMATS,
    write_csv,
    write_csv_bytes,
    write_npz,
    write_parquet,
)
from slipgrasp.recordings.palette import PHASES
from slipgrasp.recordings.still import Still, StillError

pytestmark = pytest.mark.slow

DOCUMENTS = ("scenario.json", "ending.json", "units.json", "provenance.json")


def written(write, run, **options):
    stream = io.BytesIO()
    write(run, stream, **options)
    stream.seek(0)
    return stream


def test_parquet_holds_every_column_with_its_unit(any_run):
    table = pyarrow.parquet.read_table(written(write_parquet, any_run))

    columns = columns_of(any_run.trace)
    assert table.column_names == [column.name for column in columns]
    assert table.num_rows == len(any_run.trace)
    for column in columns:
        field = table.schema.field(column.name)
        assert field.metadata[b"unit"].decode() == column.unit
        if column.holds_phases:
            expected = [ContactPhase(value).label for value in column.values]
            assert table[column.name].to_pylist() == expected
        else:
            assert table[column.name].to_numpy().tobytes() == column.values.tobytes()


def test_parquet_holds_the_scenario_the_ending_and_what_computed_it(any_run):
    metadata = pyarrow.parquet.read_schema(written(write_parquet, any_run)).metadata

    scenario = scenario_from_mapping(json.loads(metadata[b"slipgrasp.scenario"]))
    assert scenario == any_run.scenario
    ending = json.loads(metadata[b"slipgrasp.ending"])
    assert ending == json.loads(json.dumps(any_run.summary()))
    kernel = json.loads(metadata[b"slipgrasp.provenance"])["kernel"]
    assert kernel == any_run.provenance.kernel


def test_npz_holds_every_column_and_the_documents_without_pickles(any_run):
    with np.load(written(write_npz, any_run), allow_pickle=False) as arrays:
        columns = columns_of(any_run.trace)
        for column in columns:
            assert arrays[column.name].dtype == column.values.dtype
            assert arrays[column.name].tobytes() == column.values.tobytes()
        scenario = scenario_from_mapping(json.loads(arrays["scenario.json"].item()))
        ending = json.loads(arrays["ending.json"].item())
        units = json.loads(arrays["units.json"].item())
        provenance = json.loads(arrays["provenance.json"].item())
        names = set(arrays.files)
    assert scenario == any_run.scenario
    assert ending == json.loads(json.dumps(any_run.summary()))
    assert units == {column.name: column.unit for column in columns}
    assert provenance["kernel"] == any_run.provenance.kernel
    assert names == units.keys() | set(DOCUMENTS)


BEGINS = {
    "csv": b"t,",
    "parquet": b"PAR1",
    "npz": b"PK",
    "html": b"<",
    "gif": b"GIF89a",
    "mp4": b"\x00\x00\x00",
    "webm": b"\x1aE\xdf\xa3",
    "png": b"\x89PNG",
    "svg": b"<?xml",
}


@pytest.mark.parametrize("chosen", EXPORT_FORMATS, ids=lambda chosen: chosen.name)
def test_every_format_of_the_table_is_written_by_the_writer_that_it_names(short_run, chosen):
    if chosen.name in ("mp4", "webm"):
        pytest.importorskip("av")
    content = written(chosen.write, short_run, fps=1.0).getvalue()
    assert content and content.startswith(BEGINS.get(chosen.name, b""))


@pytest.mark.parametrize("write", [write_parquet, write_npz, write_csv_bytes])
def test_premises_of_the_theorems_are_further_columns_of_data(write):
    run = simulate(with_values(load_scenario("paper-case-2"), {"simulation.duration": 0.3}))
    premises = find_premises(run).columns()
    before, _ = read_table(write, written(write, run))
    names, columns = read_table(write, written(write, run, premises=True))
    assert names == [*before, *(column.name for column in premises)]
    for column in premises:
        values, unit = columns[column.name]
        np.testing.assert_array_equal(np.array(values, dtype=float), column.values)
        assert unit in (column.unit, "")
    assert np.isinf(np.array(columns["premise_radius"][0], dtype=float)).all()


def read_table(write, content):
    """Names of the columns, and the values and the unit of each, where the file tells it."""
    if write is write_parquet:
        table = pyarrow.parquet.read_table(content)
        units = {field.name: field.metadata[b"unit"].decode() for field in table.schema}
        return table.column_names, {n: (table[n].to_numpy(), units[n]) for n in units}
    if write is write_npz:
        arrays = np.load(content)
        units = json.loads(arrays["units.json"].item())
        return list(units), {name: (arrays[name], units[name]) for name in units}
    names, *rows = csv.reader(io.TextIOWrapper(content))
    return names, {name: ([row[k] for row in rows], "") for k, name in enumerate(names)}


def test_of_other_laws_no_premises_are_written(short_run):
    other = replace(short_run, scenario=load_scenario("composite-case-2"))
    with pytest.raises(PremisesError, match=r"has controller\.kind 'composite', 0 changes"):
        write_csv(other, io.StringIO(), premises=True)


@pytest.mark.parametrize("write", [write_parquet, write_npz, write_gif, write_svg])
def test_equal_runs_give_equal_files(short_run, write):
    assert written(write, short_run).getvalue() == written(write, short_run).getvalue()


def frames_of(stream):
    """Duration [ms] and picture of each frame."""
    with Image.open(stream) as film:
        for frame in range(film.n_frames):
            film.seek(frame)
            yield film.info["duration"], np.asarray(film.convert("RGB"))


def count_of(picture, colour):
    """Pixels of nearly a colour."""
    return int((np.abs(picture.astype(int) - colour).max(axis=-1) < 12).sum())


def test_the_film_runs_in_real_time_from_start_to_end(short_run):
    shares = []
    frames = list(frames_of(written(write_gif, short_run, fps=25.0, progress=shares.append)))

    times = frame_times(short_run, 25.0)
    assert times[0] == 0.0 and times[-1] == short_run.end_time
    assert np.diff(times)[:-1] == pytest.approx(0.04)
    assert len(frames) == len(times) == 9
    assert {duration for duration, _ in frames[:-1]} == {40}
    assert len(shares) == 9 and shares[-1] == 1.0


def test_fingertips_have_the_colour_of_their_phase(short_run):
    frames = [picture for _, picture in frames_of(written(write_gif, short_run, fps=25.0))]
    hand = slice(40, 340), slice(128, 512)  # above the chart, between the close-ups

    slips = (ContactPhase.SLIP_FORWARD, ContactPhase.SLIP_BACKWARD)
    for phase in slips:
        assert count_of(frames[1][hand], PHASES[phase]) > 40
        assert count_of(frames[-1][hand], PHASES[phase]) == 0
    assert count_of(frames[1][hand], PHASES[ContactPhase.STICK]) == 0
    assert count_of(frames[-1][hand], PHASES[ContactPhase.STICK]) > 80


def test_a_long_run_has_no_more_frames_than_allowed_and_still_lasts_as_long():
    long = {"simulation.duration": 60.0, "simulation.output_rate": 20.0}
    run = simulate(with_values(load_scenario("paper-case-1"), long))

    times = frame_times(run, 50.0)

    assert MAX_FRAMES / 2 < len(times) <= MAX_FRAMES
    assert times[-1] == 60.0


SLOW = Clip(start=0.02, end=0.06, speed=1 / 32, height=240)


def test_a_clip_shows_its_stretch_at_its_speed(short_run):
    frames = list(frames_of(written(write_gif, short_run, fps=25.0, clip=SLOW)))

    times = frame_times(short_run, 25.0, SLOW)
    assert (times[0], times[-1]) == (0.02, 0.06)
    assert len(frames) == len(times) == 33
    assert sum(duration for duration, _ in frames[:-1]) == pytest.approx(1000 * 32 * 0.04)
    assert frames[0][1].shape[0] == 240


@pytest.mark.parametrize("write", [write_mp4, write_webm])
def test_a_film_has_the_size_the_frames_and_the_duration_that_were_asked_for(short_run, write):
    av = pytest.importorskip("av")
    with av.open(written(write, short_run, clip=SLOW)) as film:
        pictures = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
        # The last picture stays for as long as each of the others.
        shown = film.duration / av.time_base * (len(pictures) - 1) / len(pictures)
    assert shown == pytest.approx(32 * 0.04, abs=0.01)
    assert len(pictures) == 1 + math.ceil(30 * 32 * 0.04)
    assert {picture.shape for picture in pictures} == {(240, 426, 3)}
    # The object moves on: no two of the first and the last third are alike.
    assert (pictures[0] != pictures[-1]).any(axis=-1).sum() > 100


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"speed": 0.0}, "the speed is 0; allowed: 0.0001 … 100"),
        ({"speed": float("nan")}, "the speed is nan"),
        ({"height": 5000}, "the height is 5000 px; allowed: 240 … 2160"),
        ({"start": 3.0, "end": 2.0}, "from 3 s to "),
        ({"start": 99.0}, "is empty; the run lasts from 0 s to "),
    ],
)
def test_a_clip_that_cannot_be_says_why(short_run, wrong, words):
    with pytest.raises(ClipError, match=re.escape(words)):
        written(write_gif, short_run, clip=Clip(**wrong))


def test_without_its_encoder_a_film_says_what_to_install(short_run, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(MissingPackageError, match="pip install av"):
        written(write_mp4, short_run)


SLIPPING = Still(time=0.05, width=500, height=900)


def test_a_still_has_the_size_and_the_colours_of_its_instant(short_run):
    with Image.open(written(write_png, short_run, still=SLIPPING)) as picture:
        assert picture.size == (500, 900)
        seen = np.asarray(picture.convert("RGB"))[60:570]  # what is above the chart
    for phase in (ContactPhase.SLIP_FORWARD, ContactPhase.SLIP_BACKWARD):
        assert count_of(seen, PHASES[phase]) > 100
    assert count_of(seen, PHASES[ContactPhase.STICK]) == 0


def test_a_drawing_holds_object_fingertips_forces_and_cones_in_its_size(short_run):
    root = ElementTree.fromstring(written(write_svg, short_run, still=SLIPPING).getvalue())
    assert (root.get("width"), root.get("height")) == ("500", "900")
    *_, width, height = map(float, root.get("viewBox").split())
    assert width / height == pytest.approx(500 / 900)
    parts = {part.get("id") for part in root.iter()}
    of_each = {f"{what}-{i}" for what in ("fingertip", "force", "cone") for i in (0, 1)}
    assert parts >= {"object", "desired"} | of_each


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"width": 100}, "the width is 100 px; allowed: 240 … 8192"),
        ({"height": 10**9}, "the height is 1000000000 px; allowed"),
        ({"time": 99.0}, "the run has no instant 99 s; it lasts from 0 s to "),
        ({"time": float("nan")}, "the time is nan s; it must be finite"),
    ],
)
def test_a_still_that_cannot_be_says_why(short_run, wrong, words):
    with pytest.raises(StillError, match=re.escape(words)):
        written(write_png, short_run, still=Still(**wrong))
