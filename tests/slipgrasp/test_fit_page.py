"""The page on measured data and fits: its commands print what it says."""

import re
import shlex

import pytest

from tests.fenced_blocks import DOCS, blocks_of

PAGE = (DOCS / "fit.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_commands_of_the_page_print_what_it_says(slipgrasp, in_process):
    (block,) = blocks_of(PAGE, "console")
    for text in block.text.split("$ slipgrasp ")[1:]:
        command, *shown = text.splitlines()
        done = in_process(*shlex.split(command))
        assert done.returncode == 0, done.stderr
        assert not shown or done.stdout.splitlines() == shown, command


def test_the_page_describes_every_class_of_a_parameter():
    from typing import get_args

    from slipgrasp.core.fit.profile import ParameterClass

    rows = re.findall(r"^\| `([\w ]+)` \|", PAGE, re.MULTILINE)
    assert rows == [*get_args(ParameterClass)]
