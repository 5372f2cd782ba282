"""Imports a table of measured values (CSV) as a recording, block by block.

Memory is needed for one block and the listed gaps, for a table of any length.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.trace.signals import TIME_COLUMN, Floats
from slipgrasp.recordings.file.atomic_file import atomic_file
from slipgrasp.recordings.measured.recording import (
    MAX_GAPS,
    MeasuredColumn,
    MeasuredOutline,
    MeasuredWriter,
    Sampling,
)
from slipgrasp.recordings.measured.units import (
    ImportDataError,
    check_size,
    factors_of,
    unit_of_header,
    units_of_signal,
)

if TYPE_CHECKING:
    import pyarrow

MAX_NUMBERS = 40_000_000
"""Largest number of values of a recording, samples times signals and time: 320 MB in memory."""

MAX_TIME = 1e6
BLOCK_BYTES = 1 << 20
GAP_PERIODS = 2.5
"""Number of periods after which an interval is a gap, by default."""

Rows = NDArray[np.int64]

_FIRST_ROW = 2
_EVEN_SHARE = 0.1
_TITLE_LENGTH = 200
_TIME_HEADER = re.compile(r"t(ime)?[ _]?[\[(]?(s|ms|us|µs|ns)?[\])]?", re.IGNORECASE)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportOptions:
    """Options for reading a table.

    Attributes:
        mapping: Columns of the table by name of a signal or ``t``; with a unit after a colon. Times
            are in the column ``t`` or ``time`` of the table, unless given here.
        rate: Sampling rate of a table without a column of times [Hz].
        start: Time of the first sample [s]; as in the table if None.
        every: Use only every Nth sample.
        longest_interval: Longer intervals are gaps [s]; 2.5 periods if None.
        skip_missing: Whether to skip rows with missing values instead of rejecting the table.
        title: Title of the recording.
    """

    mapping: Mapping[str, str]
    rate: float | None = None
    start: float | None = None
    every: int = 1
    longest_interval: float | None = None
    skip_missing: bool = False
    title: str = ""


@dataclass(frozen=True, slots=True)
class _Source:
    """A column of the table: its signal, and the factor to its SI unit."""

    name: str
    header: str
    unit: str
    factor: float
    is_stated: bool

    @property
    def text(self) -> str:
        spelling = next(s for s, f in factors_of(self.unit).items() if f == self.factor)
        return f"{self.header} [{spelling}]"


def import_csv(
    source: str | Path, target: Path, options: ImportOptions, *, overwrite: bool = False
) -> MeasuredOutline:
    """Imports a table with a header line as a recording.

    Args:
        source: The table; columns are separated by commas, semicolons or tabs.
        target: The recording to write.
        options: Options for reading it.
        overwrite: Whether to replace an existing recording.

    Raises:
        ImportDataError: If the table or an option is invalid; the message contains the remedy.
        RecordingError: If the recording cannot be written.
    """
    path = Path(source)
    table = _Table.of(path)
    options = _with_times(options, table.headers)
    _check_options(options)
    sources = table.sources(options.mapping)
    signals = [each for each in sources if each.name != TIME_COLUMN]
    columns = [MeasuredColumn(name=s.name, unit=s.unit, source=s.text) for s in signals]
    title = (options.title or path.stem)[:_TITLE_LENGTH]
    clock = _Clock(options, [each for each in sources if each.name == TIME_COLUMN])
    sizes = _Sizes(signals)
    with atomic_file(target, overwrite=overwrite) as stream:
        writer = MeasuredWriter(stream, title, columns)
        for rows, block in _blocks(table, sources, options):
            times = clock.take(block, rows)
            values = block[:, len(sources) - len(signals) :]
            sizes.take(values)
            _check_amount(clock.samples, len(columns) + 1)
            writer.write(times, values)
        sampling = clock.sampling()
        sizes.check()
        writer.finish(sampling)
    return MeasuredOutline(title=title, columns=tuple(columns), sampling=sampling)


def _with_times(options: ImportOptions, headers: Sequence[str]) -> ImportOptions:
    """Maps the time to the column ``t`` or ``time``, with or without a unit, if there is one."""
    found = [name.strip() for name in headers if _TIME_HEADER.fullmatch(name.strip())]
    if TIME_COLUMN in options.mapping or options.rate is not None or len(found) != 1:
        return options
    return replace(options, mapping={TIME_COLUMN: found[0], **options.mapping})


def _check_options(options: ImportOptions) -> None:
    if options.every < 1:
        raise ImportDataError(f"--every is {options.every}; allowed: 1 or more")
    has_time = TIME_COLUMN in options.mapping
    if has_time == (options.rate is not None):
        found = "both a column of times and --rate" if has_time else "no times"
        raise ImportDataError(
            f"there are {found}; give --map t=COLUMN, or --rate HZ for a table without times"
        )
    if options.rate is not None and not 1e-3 <= options.rate <= 1e6:
        raise ImportDataError(f"--rate is {options.rate:g} Hz; allowed: 0.001 … 1000000 Hz")
    if set(options.mapping) <= {TIME_COLUMN}:
        raise ImportDataError("no signal is mapped; give one with --map, such as --map x=x_m")


@dataclass(frozen=True, slots=True)
class _Table:
    """A table: its file, separator, and column names including surrounding spaces."""

    path: Path
    delimiter: str
    headers: tuple[str, ...]

    @classmethod
    def of(cls, path: Path) -> _Table:
        try:
            with path.open(encoding="utf-8-sig", newline="") as stream:
                line = stream.readline(1 << 20)
        except FileNotFoundError:
            raise ImportDataError(f"there is no file '{path}'") from None
        except OSError as error:
            raise ImportDataError(f"cannot read '{path}': {error.strerror}") from error
        except UnicodeDecodeError:
            message = f"'{path}' is not text in UTF-8; export the table as CSV in UTF-8"
            raise ImportDataError(message) from None
        delimiter = max(",;\t", key=line.count)
        headers = next(csv.reader([line], delimiter=delimiter), [])
        if not any(name.strip() for name in headers):
            message = f"'{path}' has no header line; its first line must name the columns"
            raise ImportDataError(message)
        return cls(path, delimiter, tuple(headers))

    def sources(self, mapping: Mapping[str, str]) -> list[_Source]:
        """The columns to read: the time first, if any."""
        names = [name.strip() for name in self.headers]
        ordered = sorted(mapping, key=lambda name: name != TIME_COLUMN)
        return [_source(name, mapping[name], names) for name in ordered]

    def raw_name(self, header: str) -> str:
        """The name of a column including surrounding spaces."""
        return next(name for name in self.headers if name.strip() == header)


def _source(name: str, text: str, headers: Sequence[str]) -> _Source:
    units = ("s",) if name == TIME_COLUMN else units_of_signal(name)
    header, stated = text, ""
    if text not in headers and ":" in text:
        header, _, stated = text.rpartition(":")
    if headers.count(header) != 1:
        found = "twice" if header in headers else "not"
        shown = ", ".join(headers[:40]) + (", …" if len(headers) > 40 else "")
        raise ImportDataError(
            f"--map {name}={text[:60]}: column '{header[:60]}' is {found} in the table; "
            f"its columns are {shown}"
        )
    spelling = stated or unit_of_header(header, units)
    for unit in units:
        if (spelling or unit) in factors_of(unit):
            factor = factors_of(unit)[spelling or unit]
            return _Source(name, header, unit, factor, bool(spelling))
    allowed = ", ".join(spelled for unit in units for spelled in factors_of(unit))
    raise ImportDataError(f"--map {name}={text[:60]}: unit '{stated}' is not one of {allowed}")


def _blocks(
    table: _Table, sources: Sequence[_Source], options: ImportOptions
) -> Iterator[tuple[Rows, Floats]]:
    """SI values of the mapped columns, block by block, with the row numbers.

    Row numbers start at 2, as in spreadsheets: the header is row 1.
    """
    import pyarrow
    from pyarrow import csv as arrow_csv

    names = [table.raw_name(each.header) for each in sources]
    row = _FIRST_ROW
    try:
        reader = arrow_csv.open_csv(
            table.path,
            read_options=arrow_csv.ReadOptions(block_size=BLOCK_BYTES, use_threads=False),
            parse_options=arrow_csv.ParseOptions(delimiter=table.delimiter),
            convert_options=arrow_csv.ConvertOptions(
                include_columns=list(dict.fromkeys(names)),
                column_types=dict.fromkeys(names, pyarrow.string()),
                strings_can_be_null=False,
            ),
        )
        for batch in reader:
            columns = [
                _numbers(batch.column(name), each, row) * each.factor
                for name, each in zip(names, sources, strict=True)
            ]
            block = np.stack(columns, axis=1)
            rows = np.arange(row, row + len(block))
            chosen = _kept(block, rows, sources, options)
            if chosen.any():
                yield rows[chosen], block[chosen]
            row += len(block)
    except pyarrow.ArrowInvalid as error:
        message = " ".join(str(error).split())[:160]
        raise ImportDataError(f"'{table.path}' cannot be read as a table: {message}") from error


def _numbers(column: pyarrow.Array, source: _Source, first_row: int) -> Floats:
    """Parses text as numbers; NaN if empty."""
    import pyarrow
    from pyarrow import compute

    trimmed = compute.call_function("utf8_trim_whitespace", [column])
    is_empty = compute.call_function("equal", [trimmed, ""])
    filled = compute.call_function("if_else", [is_empty, "nan", trimmed])
    try:
        return np.asarray(filled.cast(pyarrow.float64()))
    except pyarrow.ArrowInvalid:
        texts = filled.to_pylist()
        place = next(i for i, text in enumerate(texts) if not _is_number(text))
        raise ImportDataError(
            f"row {first_row + place}, column '{source.header}' ({source.name}): "
            f"'{texts[place][:40]}' is not a number; numbers have a decimal point, and no unit"
        ) from None


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _kept(
    block: Floats, rows: Rows, sources: Sequence[_Source], options: ImportOptions
) -> NDArray[np.bool_]:
    """Selects rows; incomplete rows are rejected, or skipped on request."""
    finite = np.isfinite(block)
    if not finite.all() and not options.skip_missing:
        place, column = np.argwhere(~finite)[0]
        source, value = sources[column], block[place, column]
        found = "no value" if math.isnan(value) else f"{value:g}"
        raise ImportDataError(
            f"row {rows[place]}, column '{source.header}' ({source.name}) contains {found}; every "
            "value must be a finite number; --skip-missing skips such rows and marks the gaps"
        )
    return finite.all(axis=1) & ((rows - _FIRST_ROW) % options.every == 0)


def _check_amount(samples: int, width: int) -> None:
    if samples * width > MAX_NUMBERS:
        most = MAX_NUMBERS // width
        raise ImportDataError(
            f"the table has more than {most} samples of {width - 1} signals; a recording can have "
            f"{MAX_NUMBERS} numbers; use fewer with --every N, map fewer signals, or split the "
            "table"
        )


@dataclass(slots=True)
class _Sizes:
    """Largest absolute value of every signal so far."""

    sources: Sequence[_Source]
    largest: Floats = field(default_factory=lambda: np.zeros(0))

    def take(self, values: Floats) -> None:
        sizes = np.abs(values).max(axis=0)
        self.largest = np.maximum(self.largest, sizes) if len(self.largest) else sizes

    def check(self) -> None:
        for source, largest in zip(self.sources, self.largest, strict=True):
            if not source.is_stated:
                check_size(source.name, source.header, source.unit, float(largest))


class _Clock:
    """Times of the samples: checks that they increase, and finds gaps."""

    def __init__(self, options: ImportOptions, sources: Sequence[_Source]) -> None:
        self._options = options
        self._source = sources[0] if sources else None
        self._shift: float | None = None
        self._first = self._last = 0.0
        self._period = 0.0
        self._limit = 0.0
        self._range = (math.inf, 0.0)
        self._gaps: list[tuple[float, float]] = []
        self._num_gaps = 0
        self.samples = 0

    def take(self, block: Floats, rows: Rows) -> Floats:
        """The times of the samples of a block [s].

        Raises:
            ImportDataError: If they do not increase, or exceed their limits.
        """
        times = self._times(block, rows)
        joined = np.concatenate([[self._last], times]) if self.samples else times
        intervals = np.diff(joined)
        if len(intervals) and intervals.min() <= 0.0:
            place = int(np.argmax(intervals <= 0.0))
            way_out = "sort the table, or import its parts one by one"
            if intervals[place] == 0.0:
                way_out = "keep one row of equal times"
            raise ImportDataError(
                f"row {rows[place - len(joined) + len(times) + 1]}: t goes from "
                f"{joined[place]:.9g} s to {joined[place + 1]:.9g} s; times must increase; "
                f"{way_out}"
            )
        if not self.samples:
            self._first = float(times[0])
        self._note(joined, intervals)
        self._last = float(times[-1])
        self.samples += len(times)
        return times

    def _times(self, block: Floats, rows: Rows) -> Floats:
        options = self._options
        if self._source is None:
            return (options.start or 0.0) + (rows - _FIRST_ROW) / (options.rate or 1.0)
        if self._shift is None:
            self._shift = 0.0 if options.start is None else options.start - float(block[0, 0])
        times = block[:, 0] + self._shift
        wrong = ~((times >= 0.0) & (times <= MAX_TIME))
        if wrong.any():
            place = int(np.argmax(wrong))
            raise ImportDataError(
                f"row {rows[place]}, column '{self._source.header}' (t) is {times[place]:.6g} s; "
                f"allowed: 0 … {MAX_TIME:g} s; --start 0 shifts the times so that the first is 0"
            )
        return times

    def _note(self, times: Floats, intervals: Floats) -> None:
        if not len(intervals):
            return
        if self._period == 0.0:
            self._period = float(np.median(intervals))
            usual = GAP_PERIODS * self._period
            self._limit = self._options.longest_interval or usual
            if self._source is not None and not self._source.is_stated:
                check_size(TIME_COLUMN, self._source.header, "s", self._period)
        is_gap = intervals > self._limit
        self._num_gaps += int(is_gap.sum())
        for place in np.flatnonzero(is_gap)[: MAX_GAPS - len(self._gaps)]:
            self._gaps.append((float(times[place]), float(times[place + 1])))
        usual_ones = intervals[~is_gap]
        if len(usual_ones):
            low, high = self._range
            self._range = min(low, float(usual_ones.min())), max(high, float(usual_ones.max()))

    def sampling(self) -> Sampling:
        """The sampling of the data.

        Raises:
            ImportDataError: If there are fewer than two.
        """
        if self.samples < 2:
            raise ImportDataError(
                f"the table has {self.samples} samples; a recording needs at least 2"
            )
        low, high = self._range
        share = _EVEN_SHARE * self._period
        return Sampling(
            samples=self.samples,
            start=self._first,
            end=self._last,
            period=self._period,
            even=self._period - low <= share and high - self._period <= share,
            num_gaps=self._num_gaps,
            gaps=tuple(self._gaps),
        )
