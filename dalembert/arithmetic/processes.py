"""Worker processes of this machine, as an executor that outlives their deaths."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from multiprocessing import get_context
from types import TracebackType
from typing import Any, TypeVar

R = TypeVar("R")


class Processes(Executor):
    """Worker processes on this machine: when one dies, new ones take over.

    Parameters
    ----------
    workers : int
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._pool = self._new()

    def _new(self) -> ProcessPoolExecutor:
        # each starts afresh: a copy of this process would copy what its threads hold
        return ProcessPoolExecutor(self.workers, get_context("spawn"), initializer=_ignore_interrupts)

    def submit(self, fn: Callable[..., R], /, *args: Any, **kwargs: Any) -> Future[R]:
        """Send a call to a worker."""
        try:
            return self._pool.submit(fn, *args, **kwargs)
        except BrokenExecutor:
            self._pool = self._new()
            return self._pool.submit(fn, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Let the workers go."""
        self._pool.shutdown(wait, cancel_futures=cancel_futures)

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


def _ignore_interrupts() -> None:
    """Ctrl-C is for the process that asked."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)
