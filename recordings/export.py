"""Export formats: the table of all formats, and the writers of data formats.

The command line, the REST interface and the dashboard use the table; a new format is a new entry.
The table has the names of the writers, and writers import their dependencies when they are called,
because every help text reads the table.
"""

from __future__ import annotations

import codecs
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from importlib import import_module
from importlib.util import find_spec
from itertools import chain
from typing import TYPE_CHECKING, Any, BinaryIO, Protocol

from slipgrasp.recordings.clip import WHOLE, Clip
from slipgrasp.recordings.still import AT_THE_END, Still

if TYPE_CHECKING:
    from pathlib import Path

    import pyarrow

    from slipgrasp.core.run.result import RunResult
    from slipgrasp.core.trace.columns import Column

ROWS_AT_ONCE = 1000
ROWS_PER_GROUP = 10_000
"""Rows of a Parquet file that are written and compressed together."""

SCENARIO = "scenario.json"
ENDING = "ending.json"
UNITS = "units.json"
PROVENANCE = "provenance.json"

# Files in an archive have a date; with a fixed one, equal runs give equal files.
_DATE = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportFormat:
    """An export format of runs.

    Attributes:
        name: Its name, which is also the suffix of its files.
        title: Its title for users.
        contents: The content of a file; for images their kind.
        media_type: Media type of a file.
        writer: ``module:function`` that writes a run to a stream of bytes that is seekable;
            writers of animations also take ``progress``, ``fps`` and ``clip``, those of stills
            ``still`` and ``clip``, those of data ``premises``.
        long_writer: ``module:function`` that writes the same file from the path of a recording,
            without all samples in memory; empty if there is none.
        fps: Default frames per second; None if it is not an animation.
        is_still: Whether it is a still.
        description: Its description in the REST interface, which offers data formats.
        is_text: Whether it can be shown in a terminal, and written without seeking.
        is_listed: Whether the dashboard's list of runs offers it.
        package: An optional package that it needs; empty if none.
    """

    name: str
    title: str
    contents: str
    media_type: str
    writer: str
    long_writer: str = ""
    fps: float | None = None
    is_still: bool = False
    description: str = ""
    is_text: bool = False
    is_listed: bool = False
    package: str = ""

    @property
    def is_installed(self) -> bool:
        """Whether its package is installed."""
        return not self.package or find_spec(self.package) is not None

    def write(
        self,
        result: RunResult,
        stream: BinaryIO,
        progress: Callable[[float], None] | None = None,
        fps: float | None = None,
        clip: Clip = WHOLE,
        still: Still = AT_THE_END,
        *,
        premises: bool = False,
    ) -> None:
        """Writes a run.

        Args:
            result: The run.
            stream: The stream to write.
            progress: Called with the completed fraction, 0 to 1, by slow exports.
            fps: Frames per second of an animation.
            clip: The content of an image.
            still: The instant of a still.
            premises: Whether to add the assumptions of the theorems to data.

        Raises:
            PremisesError: If they are requested and the theorems do not apply to the run.
        """
        write = _find(self.writer)
        if self.is_still:
            write(result, stream, still=still, clip=clip)
        elif self.fps is None:
            write(result, stream, premises=premises)
        else:
            write(result, stream, progress, fps=fps or self.fps, clip=clip)

    def write_long(self, path: Path, stream: BinaryIO) -> None:
        """Writes a recording without all its samples in memory.

        It does not check whether the hash and the metrics follow from the samples.

        Args:
            path: The recording, whose format states all metrics.
            stream: The stream to write.

        Raises:
            RecordingError: As `slipgrasp.recordings.file.pieces.read_pieces`.
        """
        _find(self.long_writer)(path, stream)


def _find(name: str) -> Callable[..., None]:
    module, _, function = name.partition(":")
    return getattr(import_module(module), function)


EXPORT_FORMATS = (
    ExportFormat(
        name="csv",
        title="CSV",
        contents="the main signals",
        media_type="text/csv",
        writer="slipgrasp.recordings.export:write_csv_bytes",
        long_writer="slipgrasp.recordings.export:write_long_csv",
        description="The table that ``slipgrasp export`` writes.",
        is_text=True,
        is_listed=True,
    ),
    ExportFormat(
        name="parquet",
        title="Parquet",
        contents="all signals with units, and the scenario",
        media_type="application/vnd.apache.parquet",
        writer="slipgrasp.recordings.export:write_parquet",
        long_writer="slipgrasp.recordings.export:write_long_parquet",
        description="All columns with their units, and the scenario, as a Parquet table.",
        is_listed=True,
    ),
    ExportFormat(
        name="npz",
        title="NPZ",
        contents="all signals with units, and the scenario",
        media_type="application/octet-stream",
        writer="slipgrasp.recordings.export:write_npz",
        description="All columns as NumPy arrays, and the scenario as JSON.",
    ),
    ExportFormat(
        name="html",
        title="HTML",
        contents="an HTML page that plays the 3D scene offline",
        media_type="text/html",
        writer="slipgrasp.web.charts.replay_page:write_html",
        fps=30.0,
    ),
    ExportFormat(
        name="gif",
        title="GIF",
        contents="an animated GIF",
        media_type="image/gif",
        writer="slipgrasp.figures.animation:write_gif",
        fps=20.0,
    ),
    ExportFormat(
        name="mp4",
        title="MP4",
        contents="a video (MP4, H.264)",
        media_type="video/mp4",
        writer="slipgrasp.figures.film:write_mp4",
        package="av",
        fps=30.0,
    ),
    ExportFormat(
        name="webm",
        title="WebM",
        contents="a video (WebM, VP9)",
        media_type="video/webm",
        writer="slipgrasp.figures.film:write_webm",
        package="av",
        fps=30.0,
    ),
    ExportFormat(
        name="png",
        title="PNG",
        contents="an image (PNG)",
        media_type="image/png",
        writer="slipgrasp.figures.still:write_png",
        is_still=True,
    ),
    ExportFormat(
        name="svg",
        title="SVG",
        contents="a drawing (SVG)",
        media_type="image/svg+xml",
        writer="slipgrasp.figures.still:write_svg",
        is_still=True,
    ),
)
"""All formats, in the order of presentation."""

MOVING_FORMATS = tuple(each for each in EXPORT_FORMATS if each.fps is not None)
STILL_FORMATS = tuple(each for each in EXPORT_FORMATS if each.is_still)
DATA_FORMATS = tuple(each for each in EXPORT_FORMATS if each.fps is None and not each.is_still)


class TextStream(Protocol):
    """A stream of text."""

    def write(self, text: str, /) -> object:
        """Writes some text."""
        ...


def _premise_columns(result: RunResult) -> list[Column]:
    from slipgrasp.core.run.premises import find_premises

    return find_premises(result).columns()


def write_csv(result: RunResult, stream: TextStream, *, premises: bool = False) -> None:
    """Writes a run as comma-separated values, SI units, with a header line.

    Numbers have enough digits to read back the same bits. An event has two rows with the
    same time: before and after.

    Args:
        result: The run.
        stream: The stream to write.
        premises: Whether to add the assumptions of the theorems (`slipgrasp.core.run.premises`).

    Raises:
        PremisesError: If they are requested and the theorems do not apply to the run.
    """
    from slipgrasp.core.trace.columns import short_columns

    table = short_columns(result.trace) + (_premise_columns(result) if premises else [])
    _write_names(table, stream)
    _write_rows(table, stream)


def _write_names(table: Sequence[Column], stream: TextStream) -> None:
    stream.write(",".join(column.name for column in table) + "\n")


def _write_rows(table: Sequence[Column], stream: TextStream) -> None:
    for start in range(0, len(table[0].values), ROWS_AT_ONCE):
        cells = [_cells(column, start) for column in table]
        stream.write("".join(",".join(row) + "\n" for row in zip(*cells, strict=True)))


def write_csv_bytes(result: RunResult, stream: BinaryIO, *, premises: bool = False) -> None:
    """Writes a run as comma-separated values in UTF-8; see `write_csv`."""
    write_csv(result, codecs.getwriter("utf-8")(stream), premises=premises)


def write_long_csv(path: Path, stream: BinaryIO) -> None:
    """Writes the same as `write_csv_bytes` while reading a recording."""
    from slipgrasp.core.trace.columns import short_columns
    from slipgrasp.recordings.file.pieces import read_groups

    text = codecs.getwriter("utf-8")(stream)
    for number, rows in enumerate(read_groups(path, ROWS_AT_ONCE)):
        table = short_columns(rows)
        if number == 0:
            _write_names(table, text)
        _write_rows(table, text)


def _cells(column: Column, start: int) -> list[str]:
    """Some rows of a column: phases as words, numbers with every digit."""
    piece = replace(column, values=column.values[start : start + ROWS_AT_ONCE])
    return piece.phase_labels() if piece.holds_phases else list(map(repr, piece.values.tolist()))


def write_npz(result: RunResult, stream: BinaryIO, *, premises: bool = False) -> None:
    """Writes a run as an NPZ file, which `numpy.load` opens without unpickling anything.

    It contains one array per column (`slipgrasp.core.trace.columns`; phases are -1, 0, 1), and
    arrays with one JSON text each: ``scenario.json``, ``ending.json`` (outcome, reason,
    phase changes, estimates, metrics and warnings), ``units.json`` (column to unit) and
    ``provenance.json``.

    Args:
        result: The run.
        stream: The stream to write; it must be seekable.
        premises: Whether to add the assumptions of the theorems (`slipgrasp.core.run.premises`).

    Raises:
        PremisesError: If they are requested and the theorems do not apply to the run.
    """
    import zipfile

    import numpy as np
    from numpy.lib import format as npy

    from slipgrasp.core.trace.columns import columns_of

    columns = columns_of(result.trace) + (_premise_columns(result) if premises else [])
    scenario, ending, provenance = _documents(result)
    arrays: dict[str, Any] = {column.name: column.values for column in columns}
    arrays[SCENARIO] = np.array(scenario)
    arrays[ENDING] = np.array(ending)
    arrays[UNITS] = np.array(_json({column.name: column.unit for column in columns}))
    arrays[PROVENANCE] = np.array(provenance)
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            entry = zipfile.ZipInfo(f"{name}.npy", _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            with archive.open(entry, "w", force_zip64=True) as file:
                npy.write_array(file, np.ascontiguousarray(array), allow_pickle=False)


def write_parquet(result: RunResult, stream: BinaryIO, *, premises: bool = False) -> None:
    """Writes a run as a Parquet file.

    Each column (`slipgrasp.core.trace.columns`) has its SI unit as ``unit`` in the metadata of its
    field; phases are words, as a dictionary. The metadata of the table holds in JSON
    ``slipgrasp.scenario``, ``slipgrasp.ending`` (outcome, reason, phase changes, estimates, metrics
    and warnings) and ``slipgrasp.provenance``.

    Args:
        result: The run.
        stream: The stream to write.
        premises: Whether to add the assumptions of the theorems (`slipgrasp.core.run.premises`).

    Raises:
        PremisesError: If they are requested and the theorems do not apply to the run.
    """
    from slipgrasp.core.trace.columns import columns_of

    columns = columns_of(result.trace) + (_premise_columns(result) if premises else [])
    starts = range(0, len(result.trace), ROWS_PER_GROUP)
    _write_groups(result, ([_rows_of(each, i) for each in columns] for i in starts), stream)


def write_long_parquet(path: Path, stream: BinaryIO) -> None:
    """Writes the same as `write_parquet` while reading a recording twice."""
    from slipgrasp.core.trace.columns import columns_of
    from slipgrasp.recordings.file.pieces import read_ending, read_groups

    groups = (columns_of(rows) for rows in read_groups(path, ROWS_PER_GROUP))
    _write_groups(read_ending(path), groups, stream)


def _rows_of(column: Column, start: int) -> Column:
    """A group of rows of a column."""
    return replace(column, values=column.values[start : start + ROWS_PER_GROUP])


def _write_groups(run: RunResult, groups: Iterator[list[Column]], stream: BinaryIO) -> None:
    """Writes groups of rows, with the documents of a run; all columns have the same length."""
    from pyarrow import parquet, record_batch

    first = next(groups)
    schema = _schema(first, run)
    with parquet.ParquetWriter(stream, schema) as writer:
        for columns in chain([first], groups):
            arrays = [_arrow_array(column) for column in columns]
            writer.write_batch(record_batch(arrays, schema=schema))


def _schema(columns: Sequence[Column], run: RunResult) -> pyarrow.Schema:
    import pyarrow

    fields = [
        pyarrow.field(
            column.name, _arrow_array(column).type, nullable=False, metadata={"unit": column.unit}
        )
        for column in columns
    ]
    names = ("slipgrasp.scenario", "slipgrasp.ending", "slipgrasp.provenance")
    metadata: dict[Any, Any] = dict(zip(names, _documents(run), strict=True))
    return pyarrow.schema(fields, metadata=metadata)


def _arrow_array(column: Column) -> pyarrow.Array:
    import pyarrow

    if column.holds_phases:
        return pyarrow.array(column.phase_labels()).dictionary_encode()
    return pyarrow.array(column.values)


def _documents(result: RunResult) -> tuple[str, str, str]:
    """Scenario, ending and provenance of a run in JSON."""
    from slipgrasp.recordings.file.documents import scenario_document

    scenario = scenario_document(result.scenario).decode()
    return scenario, _json(result.summary()), _json(asdict(result.provenance))


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
