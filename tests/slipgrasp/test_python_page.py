"""The examples of the page on Python run, and print what the page says."""

import pytest

import slipgrasp
from tests.fenced_blocks import DOCS, blocks_of, output_of

pytestmark = pytest.mark.slow

PAGE = (DOCS / "python.md").read_text(encoding="utf-8")
EXAMPLES = blocks_of(PAGE, "python")


def test_the_examples_print_what_the_page_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "example"}
    for example in EXAMPLES:
        assert example.printed in (None, output_of(example.text, names)), example.text


def test_every_block_of_output_belongs_to_an_example():
    outputs = len(blocks_of(PAGE, "text"))
    assert outputs == sum(example.printed is not None for example in EXAMPLES) >= 5


@pytest.mark.parametrize(
    "name",
    ["simulate", "with_law", "open_recording", "compare", "verify", "write_parquet", "write_npz"],
)
def test_the_page_tells_of_the_public_functions(name):
    assert name in slipgrasp.__all__
    assert f"{name}(" in PAGE or f"`{name}`" in PAGE
