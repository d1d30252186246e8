"""Work in self-contained parts, here or on any executor: results in the order of the parts, whoever comes first.

A part knows all that it needs, so that no number hangs on who works it out. One whose worker died is done again once.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor
from multiprocessing import get_context
from types import TracebackType
from typing import Any, TypeVar

R = TypeVar("R")
# parts that are on their way at a time
AHEAD = 64


class LostPart(RuntimeError):
    """A part whose worker died, and died again when it was done once more.

    Attributes
    ----------
    number : int
        Of the part, from 1 on.
    """

    def __init__(self, number: int) -> None:
        super().__init__(f"part {number}: its worker died, and died again when it was done once more")
        self.number = number

    def __reduce__(self) -> tuple[type[LostPart], tuple[int]]:
        return LostPart, (self.number,)


def in_parts(
    function: Callable[..., R],
    parts: Iterable[tuple[Any, ...]],
    executor: Executor | None = None,
    ahead: int = AHEAD,
) -> Generator[R, None, None]:
    """Give what a function returns of each part, in their order.

    Parameters
    ----------
    function : callable
        Of the values of a part; another process must be able to import it.
    parts : iterable of tuple
    executor : concurrent.futures.Executor
        None: the work is done here.
    ahead : int
        How many parts are on their way at a time: so many results may wait for one that takes long.

    Raises
    ------
    LostPart
        Where the worker of one part died twice.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> with ThreadPoolExecutor(2) as pool:
    ...     list(in_parts(pow, [(2, 3), (3, 2)], pool)), list(in_parts(pow, [(2, 3), (3, 2)]))
    ([8, 9], [8, 9])
    """
    if executor is None:
        yield from (function(*part) for part in parts)
        return
    waiting: deque[tuple[int, tuple[Any, ...], Future[R]]] = deque()
    try:
        for number, part in enumerate(parts, 1):
            waiting.append((number, part, executor.submit(function, *part)))
            if len(waiting) >= ahead:
                yield _result(executor, function, *waiting.popleft())
        while waiting:
            yield _result(executor, function, *waiting.popleft())
    finally:
        for _, _, future in waiting:
            future.cancel()


def _result(
    executor: Executor, function: Callable[..., R], number: int, part: tuple[Any, ...], future: Future[R]
) -> R:
    try:
        return future.result()
    except Exception as error:
        if not _lost(error):
            raise
    try:
        return executor.submit(function, *part).result()
    except Exception as error:
        if not _lost(error):
            raise
        raise LostPart(number) from None


def _lost(error: Exception) -> bool:
    """Whether it is the worker that failed; those of a cluster have exceptions of their own."""
    return isinstance(error, (BrokenExecutor, CancelledError, ConnectionError)) or type(error).__name__ in (
        "KilledWorker",
        "WorkerCrashedError",
    )


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
