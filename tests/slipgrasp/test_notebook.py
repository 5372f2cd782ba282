"""`slipgrasp.show`: what notebooks hold; shown in tests/web/test_page_in_a_browser.py."""

import re
from html import unescape

import pytest

import slipgrasp

pytestmark = pytest.mark.slow


def test_the_output_of_a_cell_holds_the_whole_page():
    result = slipgrasp.simulate(slipgrasp.load_scenario("paper-case-1"))
    page = slipgrasp.show(result, controls=("object.mass",), height=500)
    html = page._repr_html_()
    (held,) = re.findall(r'srcdoc="([^"]*)"', html)
    assert unescape(held) == page.html
    assert page.html.startswith("<!doctype html>")
    assert "height:500px" in html


def test_what_a_page_cannot_simulate_is_refused():
    with pytest.raises(slipgrasp.SlipgraspError, match="patches"):
        slipgrasp.show(slipgrasp.load_scenario("wet-patch"))
