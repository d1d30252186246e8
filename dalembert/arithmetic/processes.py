"""Worker processes of this machine, as an executor that outlives their deaths.

Results come back as files: a worker that is killed while it sends a long one through the pipe that all share leaves the
reader waiting for its rest, and the other workers for their turn.
"""

from __future__ import annotations

import pickle
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from itertools import count
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType, TracebackType
from typing import Any, TypeVar

R = TypeVar("R")


class Processes(Executor):
    """Worker processes on this machine: when one dies, new ones replace all.

    Parameters
    ----------
    workers : int
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._pool = self._new()
        self._folder, self._numbers = TemporaryDirectory(prefix="dalembert-"), count()

    def _new(self) -> ProcessPoolExecutor:
        # each starts afresh: a copy of this process would copy what its threads hold
        return ProcessPoolExecutor(self.workers, get_context("spawn"), initializer=_ignore_interrupts)

    def submit(self, fn: Callable[..., R], /, *args: Any, **kwargs: Any) -> Future[R]:
        """Send a call to a worker."""
        file = Path(self._folder.name, str(next(self._numbers)))
        # a worker may start here; a Ctrl-C during its start would make it show a traceback
        with _interrupts_later():
            try:
                sent = self._pool.submit(_write_result, file, fn, args, kwargs)
            except BrokenExecutor:
                self._pool = self._new()
                sent = self._pool.submit(_write_result, file, fn, args, kwargs)
        result: _FromFile[R] = _FromFile(sent)
        sent.add_done_callback(partial(result.read, file))
        return result

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers."""
        self._pool.shutdown(wait, cancel_futures=cancel_futures)
        if wait:
            self._folder.cleanup()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool | None:
        if kind is None:
            self.shutdown()
            return None
        # whatever stopped the work, Ctrl-C too: what is begun is let finish, for a worker that is killed while it is sent
        # something leaves its sender waiting, and nothing else is begun
        self.shutdown(cancel_futures=True)
        return None


class _FromFile(Future[R]):
    """The result of a call that leaves it in a file."""

    def __init__(self, sent: Future[None]) -> None:
        super().__init__()
        self._sent = sent

    def cancel(self) -> bool:
        """Cancel the call, where it has not begun."""
        return self._sent.cancel()

    def read(self, file: Path, sent: Future[None]) -> None:
        """Read the result, once the call is done."""
        if sent.cancelled():
            super().cancel()
        if not self.set_running_or_notify_cancel():
            return
        error = sent.exception()
        if error is None:
            try:
                self.set_result(pickle.loads(file.read_bytes()))
            except Exception as own:
                error = own
        file.unlink(missing_ok=True)
        if error is not None:
            self.set_exception(error)


def _write_result(file: Path, fn: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]) -> None:
    """Call a function, and leave what it returns in a file."""
    file.write_bytes(pickle.dumps(fn(*args, **kwargs), protocol=pickle.HIGHEST_PROTOCOL))


def _ignore_interrupts() -> None:
    """Ctrl-C is for the process that sent the work."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def _interrupts_later() -> Iterator[None]:
    """Delay Ctrl-C in this process until the end; processes that start meanwhile never receive it."""
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    held: list[tuple[int, FrameType | None]] = []
    signal.signal(signal.SIGINT, lambda number, frame: held.append((number, frame)))
    mask = (
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
        if hasattr(signal, "pthread_sigmask")
        else None
    )
    try:
        yield
    finally:
        if mask is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        signal.signal(signal.SIGINT, before)
    if held:
        before(*held[0])
