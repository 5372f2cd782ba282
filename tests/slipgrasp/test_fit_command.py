"""``slipgrasp fit`` on the command line: report, page, interruption, bad input."""

import json

import pytest

TRUTH = ("object.mass=1.13", "fingers.0.friction=0.27", "fingers.1.friction=0.23")
FIT = (
    *("--scenario", "paper-case-1", "--free", "object.mass,fingers.*.friction"),
    *("--signals", "object_pose:2e-4,slip:2e-4", "--starts", "2"),
)


@pytest.fixture
def table(slipgrasp, in_process):
    """A table of measured values, as a sensor would write it: a run, rounded."""
    run = ["run", "paper-case-1", "--set", "simulation.duration=0.2", "--output", "run.mcap"]
    assert in_process(*run, *(a for each in TRUTH for a in ("--set", each))).returncode == 0
    rows = in_process("export", "run.mcap").stdout.splitlines()
    names = rows[0].split(",")
    lines, last = ["t_s,x_mm,y_mm,yaw_mrad,s0_mm,s1_mm"], None
    for row in rows[1:]:
        cells = dict(zip(names, row.split(","), strict=True))
        if cells["t"] != last:
            last = cells["t"]
            keys = ("x", "y", "theta", "slip_0", "slip_1")
            lines.append(",".join([last, *(f"{1e3 * float(cells[key]):.1f}" for key in keys)]))
    (slipgrasp.folder / "data.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return ("data.csv", "--map", "t=t_s,x=x_mm,y=y_mm,theta=yaw_mrad,slip_0=s0_mm,slip_1=s1_mm")


@pytest.mark.slow
def test_a_table_is_fitted_and_reported_as_json_and_as_a_page(slipgrasp, in_process, table):
    done = in_process(
        "fit", *table, *FIT, "--output", "fit.mcap", "--held-out", "run.mcap", "--json"
    )
    found = json.loads(done.stdout)

    assert done.returncode == 0, done.stderr
    for key, _, truth in (each.partition("=") for each in TRUTH):
        parameter = found["parameters"][key]
        assert parameter["class"] == "bounded"
        assert parameter["low"] < float(truth) < parameter["high"]
    assert found["starts"]["count"] == 2
    assert found["held_out"][0]["name"] == "run.mcap"
    assert json.loads((slipgrasp.folder / "fit.json").read_text()).items() <= found.items()
    page = (slipgrasp.folder / "fit.html").read_text()
    assert [page.count(f"<h2>{number} ") for number in range(1, 10)] == [1] * 9
    assert page.count("<svg") == 2
    assert "http" not in page.replace("http://www.w3.org", "").replace(
        "http://purl.org", ""
    ).replace("http://creativecommons.org", "")
    again = in_process("fit", *table, *FIT, "--output", "fit.mcap")
    assert (again.returncode, "already exists" in again.stderr) == (2, True)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["--signals", "slip"], "SIGNAL:NOISE"),
        (["--signals", "torque_0_0:1"], "'torque_0_0' was not measured"),
        (["--free", "object.mas"], "did you mean 'object.mass'"),
        (["--nuisance", "wind"], "allowed are delay, force_bias"),
        (["--scenario", "paper-case-9"], "paper-case-9"),
        (["--starts", "0"], "allowed: 1 … 256"),
    ],
)
def test_bad_input_is_refused_in_a_sentence(slipgrasp, in_process, table, changes, words):
    done = in_process("fit", *table, *FIT, *changes, "--output", "fit.mcap")

    assert (done.returncode, done.stdout) == (2, "")
    assert words in done.stderr
    assert not list(slipgrasp.folder.glob("fit.*"))
