"""The viewer server that pages are served by: what it changes about viser."""

import asyncio
import threading
from concurrent.futures import Future

from viser import _gui_api, _scene_api
from viser._messages import ResetGuiMessage
from viser.infra import _infra

from slipgrasp.server.viewer.server import MAX_THREADS, ViewerServer
from tests.waiting import PATIENCE

MANY = 40


def test_callbacks_run_in_few_threads():
    server = ViewerServer()
    try:
        names = [
            server._thread_executor.submit(lambda: threading.current_thread().name)
            for _ in range(MANY)
        ]
        assert len({name.result(PATIENCE) for name in names}) <= MAX_THREADS
        assert len(server._thread_executor._threads) <= MAX_THREADS
    finally:
        server.stop()


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


def test_messages_of_other_threads_wake_the_sender_in_its_loop_alone() -> None:
    async def send_from_a_thread(is_batch: bool) -> list[str]:
        loop, woken_in = asyncio.get_running_loop(), list[str]()
        buffer = _infra.AsyncMessageBuffer(loop, persistent_messages=False)
        waiting = loop.create_task(buffer.message_event.wait())
        await asyncio.sleep(0)
        (future,) = buffer.message_event._waiters
        future.add_done_callback(lambda _: woken_in.append(threading.current_thread().name))

        def send() -> None:
            if is_batch:
                buffer.atomic_start()
            buffer.push(ResetGuiMessage())
            woken_in.append("woken" if future.done() else "still waiting")
            if is_batch:
                buffer.atomic_end()

        thread = threading.Thread(target=send)
        thread.start()
        thread.join()
        await asyncio.wait_for(waiting, PATIENCE)
        return woken_in

    ViewerServer().stop()
    here = threading.current_thread().name
    for is_batch in (False, True):
        assert asyncio.run(send_from_a_thread(is_batch)) == ["still waiting", here]
