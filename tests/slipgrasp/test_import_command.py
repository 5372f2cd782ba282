"""``slipgrasp import``: measured data beside runs on the command line."""

import json

import pytest

TABLE = "t_s,px_mm,yaw_deg\n" + "".join(f"{0.005 * i:.3f},{1466},{0}\n" for i in range(41))
MAP = "t=t_s,x=px_mm,theta=yaw_deg"


@pytest.fixture
def measured(slipgrasp, in_process):
    (slipgrasp.folder / "data.csv").write_text(TABLE, encoding="utf-8")
    done = in_process("import", "data.csv", "--map", MAP, "--output", "data.mcap")
    assert done.returncode == 0, done.stderr
    return done


def test_the_command_says_what_it_has_read(measured):
    assert measured.stdout.splitlines()[:3] == [
        "data: measured x, theta; 41 samples at 200 Hz from 0 to 0.2 s",
        "  x                        m      from px_mm [mm]",
        "  theta                    rad    from yaw_deg [deg]",
    ]


def test_without_an_output_the_recording_is_stored_and_named_by_its_id(slipgrasp, in_process):
    (slipgrasp.folder / "data.csv").write_text(TABLE, encoding="utf-8")
    done = in_process("import", "data.csv", "--map", MAP, "--title", "cube", "--json")
    found = json.loads(done.stdout)

    assert (found["kind"], found["title"], found["sampling"]["samples"]) == ("measured", "cube", 41)
    verified = in_process("verify", found["id"], "--json")
    assert verified.returncode == 0
    assert json.loads(verified.stdout)["same"] is None


def test_diff_gives_the_distance_of_each_signal_from_a_run(measured, in_process):
    command = ("run", "paper-case-2", "--set", "simulation.duration=0.5", "--output", "run.mcap")
    assert in_process(*command).returncode == 0
    done = in_process("diff", "run.mcap", "data.mcap", "--json")
    found = json.loads(done.stdout)

    assert (done.returncode, found["kind"]) == (1, "measured")
    assert found["signals"]["x"]["samples"] == 41
    assert found["signals"]["x"]["rms"] < 1e-6
    assert "Deviation from the measured data" in in_process("diff", "run.mcap", "data.mcap").stdout
    assert in_process("diff", "data.mcap", "run.mcap", "--tolerance", "0.1").returncode == 0
    refused = in_process("diff", "run.mcap", "data.mcap", "--figure", "x.svg")
    assert (refused.returncode, "measured data" in refused.stderr) == (2, True)


def test_export_writes_a_table_and_refuses_a_film(measured, in_process):
    assert in_process("export", "data.mcap").stdout.startswith("t,x,theta\n0.0,1.466,0.0\n")
    refused = in_process("export", "data.mcap", "--output", "film.gif")

    assert refused.returncode == 2
    assert "choose csv, parquet or npz" in refused.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--map", "x"], "SIGNAL=COLUMN"),
        (["--map", "t=t_s,x=px_mm", "--map", "x=px_mm"], "gives x twice"),
        (["--map", "t=t_s,x=nothing"], "its columns are t_s, px_mm, yaw_deg"),
    ],
)
def test_a_wrong_mapping_is_refused_in_a_sentence(slipgrasp, in_process, arguments, words):
    (slipgrasp.folder / "data.csv").write_text(TABLE, encoding="utf-8")
    done = in_process("import", "data.csv", *arguments)

    assert (done.returncode, done.stdout) == (2, "")
    assert words in done.stderr
    assert slipgrasp.saved() == []
