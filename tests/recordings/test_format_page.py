"""The page on the format says of every topic what the schemas say."""

import csv
import hashlib
import struct
from pathlib import Path

from slipgrasp.core.run.premises import premise_signals
from slipgrasp.core.trace.signals import SIGNALS
from slipgrasp.recordings.file.schemas import OWN_TOPICS, SAMPLE_TOPICS, TICKS
from slipgrasp.recordings.file.state_hash import state_hash
from slipgrasp.recordings.file.versions import PLANAR_FORMAT, SPATIAL_FORMAT

PAGE = Path(__file__).parents[2] / "docs" / "recordings.md"
ENTRIES = {
    "": "",
    "pose": "3",
    "coordinate": "3",
    "contact": "contacts",
    "tangent": "contacts",
    "joint": "joints",
    "unknown": "unknowns",
    "diagnostic": "diagnostics",
}
TICK_ENTRIES = {"commands": "joints", "estimates": "unknowns", "diagnostics": "diagnostics"}


def listed(name: str) -> list[list[str]]:
    """The rows of a table of the page, which are in a file."""
    with PAGE.with_name("data").joinpath(f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def topic_rows() -> list[list[str]]:
    """Every field of every topic."""
    per = {signal.name: signal.per for signal in SIGNALS}
    rows = [["topic", "schema", "field", "type", "meaning and unit"]]
    for topic in OWN_TOPICS:
        for field in topic.fields:
            count = ENTRIES.get(per.get(field.name, "")) if topic in SAMPLE_TOPICS else field.width
            count = TICK_ENTRIES.get(field.name, count) if topic == TICKS else count
            kind = f"{field.kind}[{count}]" if field.repeated else field.kind
            rows.append([topic.name, topic.schema_name, field.name, kind, field.text])
    return rows


def test_every_topic_and_field_is_on_the_page():
    assert listed("topics") == topic_rows()
    page = PAGE.read_text(encoding="utf-8")
    assert [topic.name for topic in OWN_TOPICS if f"`{topic.name}`" not in page] == []


def premise_rows() -> list[list[str]]:
    """The columns that are evaluated on demand."""
    rows = [["column", "meaning and unit"]]
    for name, signal in premise_signals().items():
        rows.append([f"{signal.prefix}_{name}", f"{signal.text} [{signal.unit}]"])
    return rows


def test_every_premise_is_on_the_page():
    assert listed("premises") == premise_rows()


def test_the_page_is_about_the_present_format():
    page = PAGE.read_text(encoding="utf-8")
    assert f"**format {PLANAR_FORMAT}**" in page
    assert f"**format {SPATIAL_FORMAT}**" in page


def test_the_hash_is_what_the_page_says(short_run):
    def blake(data: bytes) -> bytes:
        return hashlib.blake2b(data, digest_size=16).digest()

    samples, changes = b"", b""
    for row in short_run.trace.to_rows():
        samples += struct.pack(f"<{len(row)}d", *row)
    for c in short_run.phase_changes:
        changes += struct.pack("<dibb", c.time, c.contact, c.from_phase, c.to_phase)
    of_samples = (32).to_bytes(8, "little") + hashlib.sha256(samples).digest()
    of_changes = (16).to_bytes(8, "little") + blake(changes)
    ticks = b"".join(struct.pack(f"<{len(row)}d", *row) for row in short_run.ticks.to_rows())
    of_ticks = (32).to_bytes(8, "little") + hashlib.sha256(ticks).digest()
    expected = blake(of_samples + of_changes + of_ticks)
    assert state_hash(short_run) == expected.hex()
