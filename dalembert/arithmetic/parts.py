"""Work in self-contained parts, here or on any executor: results in the order of the parts, whoever comes first.

A part knows all that it needs, so that no number depends on who works it out. One whose worker died is done again once.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from concurrent.futures import Executor, Future

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
        super().__init__(f"part {number}: its worker process died twice")
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
    calls = partial(_answered, function)
    waiting: deque[tuple[int, tuple[Any, ...], Future[R | _Raised]]] = deque()
    try:
        for number, part in enumerate(parts, 1):
            waiting.append((number, part, executor.submit(calls, *part)))
            if len(waiting) >= ahead:
                yield _result(executor, calls, *waiting.popleft())
        while waiting:
            yield _result(executor, calls, *waiting.popleft())
    finally:
        for _, _, future in waiting:
            future.cancel()


class _Raised:
    """An error of the work itself: it comes back whole, whatever its class asks for to be made."""

    def __init__(self, error: Exception) -> None:
        self.kind, self.args = type(error), error.args
        self.more: tuple[Any, ...] = tuple(error.__reduce__()[2:])

    def again(self) -> Exception:
        """The error."""
        error = self.kind.__new__(self.kind, *self.args)
        error.args = self.args
        for state in self.more:
            error.__setstate__(state)
        return error


def _answered(function: Callable[..., R], *part: Any) -> R | _Raised:
    try:
        return function(*part)
    except Exception as error:
        return _Raised(error)


def _result(
    executor: Executor,
    calls: Callable[..., R | _Raised],
    number: int,
    part: tuple[Any, ...],
    future: Future[R | _Raised],
) -> R:
    result = _sent(executor, calls, number, part, future)
    if isinstance(result, _Raised):
        raise result.again()
    return result


def _sent(
    executor: Executor,
    calls: Callable[..., R],
    number: int,
    part: tuple[Any, ...],
    future: Future[R],
) -> R:
    try:
        return future.result()
    except Exception as error:
        if not _lost(error):
            raise
    try:
        return executor.submit(calls, *part).result()
    except Exception as error:
        if not _lost(error):
            raise
        raise LostPart(number) from None


def _lost(error: Exception) -> bool:
    """Whether it is the worker that failed; those of a cluster have exceptions of their own."""
    from concurrent.futures import BrokenExecutor, CancelledError

    return isinstance(error, (BrokenExecutor, CancelledError, ConnectionError)) or type(error).__name__ in (
        "KilledWorker",
        "WorkerCrashedError",
    )
