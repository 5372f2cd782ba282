"""The viewer server that pages are served by: what it changes about viser."""

from collections.abc import Sequence
from concurrent.futures import Future
from zipfile import ZipFile

from viser import IconName, _gui_api, _icons, _scene_api

from slipgrasp.server.viewer.server import ViewerServer

MANY = 40


def test_icons_are_read_once_however_many_a_page_has():
    with ZipFile(_icons.ICONS_DIR / "tabler-icons.zip") as archive:
        icons = [IconName(name.removesuffix(".svg")) for name in archive.namelist()[1 : MANY + 1]]
    server = ViewerServer()
    try:
        reads = [_reads(server, icons) for _ in range(2)]
    finally:
        server.stop()
    assert reads == [MANY, 0]


def test_an_error_of_a_callback_is_logged_and_not_printed(caplog, capsys) -> None:
    server = ViewerServer()
    server.stop()
    failed: Future[None] = Future()
    failed.set_exception(ValueError("from a callback"))
    _gui_api.print_threadpool_errors(failed)
    _scene_api.print_awaited_callback_error(ValueError("from another"))
    assert "failed with exception" not in capsys.readouterr().err
    assert [str(record.exc_info[1]) for record in caplog.records if record.exc_info] == [
        "from a callback",
        "from another",
    ]


def _reads(server: ViewerServer, icons: Sequence[IconName]) -> int:
    """How often viser looks into its archive for buttons with these icons."""
    before = _icons.svg_from_icon.cache_info().misses
    for icon in icons:
        server.gui.add_button("", icon=icon)
    return _icons.svg_from_icon.cache_info().misses - before
