"""``slipgrasp verify``: simulate a recording again and compare."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING, Any

from slipgrasp.cli.arguments import add_data_directory, know_law, recording_path
from slipgrasp.cli.progress import Progress, load_simulation
from slipgrasp.cli.status import ExitStatus

if TYPE_CHECKING:
    from slipgrasp.core.scenario.custom_laws import LawIdentity
    from slipgrasp.recordings.compare.verification import Verification
    from slipgrasp.recordings.measured.recording import MeasuredOutline

MOST_NAMES = 6
NAME = "verify"
HELP = "simulate a recording again and compare"
DESCRIPTION = (
    "Simulate the scenario of a recording again, and compare. With the same version of the "
    "numerics every bit must agree, on any machine. With another version the columns must agree "
    "within 1e-8 until the first phase change after the start, the order of the phase changes must "
    "be the same, and their times must agree within 1e-6 s. For custom laws the recorded commands "
    "are used, so that the law is not needed. A run that was stopped early is compared up to its "
    "last sample."
)
EPILOG = (
    "exit status: 0 equal, or nothing to verify, 1 different or altered, 2 cannot be read or "
    "simulated"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument(
        "recording", metavar="FILE.mcap|ID", help="the recording, or the id of a stored run"
    )
    parser.add_argument(
        "--law",
        metavar="FILE.py:Name",
        nargs="?",
        const="",
        help="also run the code of the custom law, from this file or, without a value, the "
        "installed one (default: use its recorded commands)",
    )
    parser.add_argument(
        "--hash",
        action="store_true",
        help="also print the SHA-256 of the recorded run, as `run --json` does",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    add_data_directory(parser)


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    path = recording_path(arguments.recording, arguments.data_directory)
    with Progress("reading the recording"):
        from slipgrasp.recordings.file.reader import read_back
        from slipgrasp.recordings.measured.recording import is_measured, read_measured

        if is_measured(path):
            return _say_nothing_to_verify(read_measured(path).outline, as_json=arguments.json)

        read = read_back(path)
    load_simulation(read.result.scenario)
    with_law = arguments.law is not None
    if with_law and read.result.provenance.law is not None:
        know_law(arguments.law or read.result.provenance.law.name)
    from slipgrasp.recordings.compare.verification import verify

    with Progress("simulating again") as progress:
        found = verify(
            read.result,
            unaltered=read.is_unaltered,
            with_law=with_law,
            progress=progress.update,
        )
    if arguments.json:
        document = {"name": read.result.name, "sha256": read.result.sha256, **found.to_mapping()}
        print(json.dumps(document, allow_nan=False))
    else:
        print("\n".join(_lines(found)))
        if arguments.hash:
            print(f"SHA-256 of the recorded run: {read.result.sha256}")
    return ExitStatus.COMPLETED if found.same else ExitStatus.DIFFERENT


def _say_nothing_to_verify(outline: MeasuredOutline, *, as_json: bool) -> ExitStatus:
    """Reports that measured data cannot be verified; their checksums were compared."""
    message = "nothing to verify: measured data are not simulated; the file is complete"
    if as_json:
        document = {"name": outline.title, "kind": "measured", "same": None, "message": message}
        print(json.dumps(document, allow_nan=False))
    else:
        print(f"{message[0].upper()}{message[1:]}.")
    return ExitStatus.COMPLETED


def _lines(found: Verification) -> list[str]:
    return [_outcome(found), *_altered(found), _rule(found), *_law(found), _extent(found)]


def _outcome(found: Verification) -> str:
    if found.same:
        return "Equal: simulating the scenario again reproduces the recording."
    if not found.mismatches:
        return "Altered: the samples match the scenario, but the file was changed after writing."
    first = found.mismatches[0]
    if len(found.mismatches) == 1 and first.what == "law":
        return "Different: another version of the law ran, with the same samples."
    when = "" if first.time is None else f" at {first.time:.9g} s"
    said = f"{_value(first.recorded)} recorded, {_value(first.computed)} computed"
    others = [mismatch.what for mismatch in found.mismatches[1:]]
    more = "" if not others else f"; then {_some(others)}"
    return f"Different: {first.what}{when}: {said}{more}."


def _some(names: list[str]) -> str:
    hidden = len(names) - MOST_NAMES
    return ", ".join(names[:MOST_NAMES]) + (f" and {hidden} more" if hidden > 0 else "")


def _altered(found: Verification) -> list[str]:
    if found.unaltered:
        return []
    return ["The samples or documents do not match the hash in the file."]


def _rule(found: Verification) -> str:
    recorded, present = found.recorded, found.present
    if found.bit_for_bit:
        earlier = "" if recorded.kernel == present.kernel else f", earlier {recorded.kernel}"
        return f"Compared bit for bit: the numerics are the same ({present.kernel}{earlier})."
    was = f"{recorded.program} ({recorded.kernel or 'machine code not recorded'})"
    rule = (
        f"Compared within the tolerance: recorded by version {was}, "
        f"this is {present.program} ({present.kernel})."
    )
    if recorded.is_portable:
        return rule
    return f"{rule} Before format 5, bits are equal only for the same machine code."


def _law(found: Verification) -> list[str]:
    law, ran = found.recorded.law, found.present.law
    if law is None:
        return []
    if found.replayed:
        did = "its recorded commands were used"
    elif law == ran or ran is None:
        did = "its code was run as well"
    else:
        did = f"the law that ran is {_identity(ran)}"
    return [f"The law is {_identity(law)}; {did}."]


def _identity(law: LawIdentity) -> str:
    version = f" {law.version}" if law.version else ""
    return f"'{law.name}'{version} ({law.digest[:12] or 'no code'})"


def _extent(found: Verification) -> str:
    samples = f"{found.num_samples} samples up to {found.end_time:.6g} s"
    if found.whole:
        return f"Compared the whole run, {samples}."
    return f"Compared the recorded part of a run that was stopped early, {samples}."


def _value(value: Any) -> str:
    return "nothing" if value is None else repr(value) if isinstance(value, float) else str(value)
