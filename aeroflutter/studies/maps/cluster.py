"""An executor on a Dask cluster that is already running somewhere."""

from __future__ import annotations

import logging
import re
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from threading import Thread
from typing import TYPE_CHECKING, Any

from aeroflutter.errors import AeroflutterError, InputError
from aeroflutter.studies.maps.study import Outcome, Task, Work, carry_out

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["Cluster"]

CONNECT_SECONDS = 10
_ADDRESS = re.compile(r"(tcp|tls|ws|wss)://\S+:\d{1,5}")


@dataclass(frozen=True)
class Cluster:
    """Workers of a Dask scheduler.

    The scheduler repeats the blocks of workers that died and gives a block up when too many died
    at it (`distributed.scheduler.allowed-failures`). It counts every block that such a worker
    had at hand, so a block given up is tried once more, alone, before it counts as failed.

    Parameters
    ----------
    address : str
        Of the scheduler, as in ``tcp://10.0.0.1:8786``.

    Raises
    ------
    InputError
        If Dask is not installed, no scheduler answers, or its workers run another version.
    AeroflutterError
        If the scheduler goes away in the middle.
    """

    address: str

    @property
    def workers(self) -> int:
        """Threads of all workers at present."""
        with _client(self.address) as client:
            return int(sum(client.nthreads().values()))

    def run(self, study: Work, tasks: Sequence[Task]) -> Iterator[Outcome]:
        """Outcomes as they come."""
        with _client(self.address) as client:
            _check_versions(client)
            try:
                yield from _rounds(client, study, tasks)
            except OSError:  # a connection that breaks amid a question
                raise AeroflutterError(_GONE) from None


_KILLED = "its workers died again and again"
_GONE = "the Dask scheduler has gone"


def _rounds(client: Client, study: Work, tasks: Sequence[Task]) -> Iterator[Outcome]:
    """All tasks, then those again, alone, that were given up."""
    suspects: list[Task] = []
    for outcome in _round(client, study, tasks):
        if outcome.arrays is None and outcome.failure == _KILLED:
            suspects.append(outcome.task)
        else:
            yield outcome
    for task in suspects:
        yield from _round(client, study, [task])


def _round(client: Client, study: Work, tasks: Sequence[Task]) -> Iterator[Outcome]:
    """Each task once, a few more at a time than there are threads."""
    from distributed import as_completed

    waiting = deque(tasks)
    [shared] = client.scatter([study], broadcast=True, hash=False)
    stream = as_completed(loop=client.loop)
    at_hand: dict[Any, Task] = {}

    def submit() -> None:
        task = waiting.popleft()
        future = client.submit(_compute, shared, task, pure=False)
        at_hand[future.key] = task
        stream.add(future)

    for _ in range(min(len(waiting), 2 * sum(client.nthreads().values()) + 2)):
        submit()
    for future in stream:
        yield _outcome(future, at_hand.pop(future.key))
        if waiting:
            submit()


def _compute(study: Work, task: Task) -> tuple[Any, float, str | None]:
    """One block on a worker, compiled before its time is taken."""
    study.warm_up()
    outcome = carry_out(study, task)
    return outcome.arrays, outcome.cpu, outcome.failure


def _outcome(future: Any, task: Task) -> Outcome:
    from distributed import KilledWorker

    if future.cancelled():
        raise AeroflutterError(_GONE)
    error = future.exception()
    if error is None:
        arrays, cpu, failure = future.result()
        return Outcome(task, arrays, cpu, failure)
    if isinstance(error, KilledWorker):
        return Outcome(task, None, 0.0, _KILLED)
    return Outcome(task, None, 0.0, f"{type(error).__name__}: {error}")


def _client(address: str) -> Client:
    try:
        from distributed import Client, Security
    except ImportError:
        raise InputError(
            "--scheduler: needs Dask; install it with `pip install aeroflutter[cluster]`"
        ) from None
    if not _ADDRESS.fullmatch(address):
        raise InputError(f"--scheduler {address}: must be an address as in tcp://10.0.0.1:8786")
    safe = address.startswith(("tls:", "wss:"))
    if safe and Security().get_connection_args("client").get("ssl_context") is None:
        raise InputError(
            f"--scheduler {address}: needs certificates; name them in Dask's configuration, "
            "distributed.comm.tls"
        )
    for name in ("distributed", "distributed.client"):  # of its own level, by Dask's configuration
        logging.getLogger(name).setLevel(logging.CRITICAL)  # what ails it is raised
    # Something that listens there and is no scheduler may never answer, whatever the timeout.
    asking = Future[Any]()
    Thread(target=_ask, args=(asking, Client, address), daemon=True).start()
    try:
        return asking.result(timeout=2 * CONNECT_SECONDS)
    except Exception as error:  # noqa: BLE001 - a scheduler of another version may raise anything
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"--scheduler {address}: no Dask scheduler answers ({reason})") from None


def _ask(asking: Future[Any], Client: Any, address: str) -> None:
    try:
        asking.set_result(Client(address, timeout=CONNECT_SECONDS, set_as_default=False))
    except Exception as error:  # noqa: BLE001 - raised where it is waited for
        asking.set_exception(error)


def _check_versions(client: Client) -> None:
    """Refuse workers whose numbers would not be those of this process."""
    address = client.scheduler_info()["address"]
    try:
        client.wait_for_workers(1, timeout=CONNECT_SECONDS)
    except TimeoutError:
        raise InputError(
            f"--scheduler {address}: has no workers; start some with `dask worker {address}`"
        ) from None
    here = _fingerprint()
    for worker, there in client.run(_fingerprint, on_error="return").items():
        if isinstance(there, BaseException):
            what = " ".join(f"{type(there).__name__}: {there}".split())
            raise InputError(
                f"--scheduler {address}: worker {worker} lacks aeroflutter, or cannot load it "
                f"({what}); install this version where the workers run"
            )
        if there != here:
            raise InputError(
                f"--scheduler {address}: worker {worker} runs another version of aeroflutter; "
                "install this one there"
            )


def _fingerprint() -> str:
    from aeroflutter.studies.maps.fingerprint import code_hash

    return code_hash(
        "aeroflutter.studies.cases",
        "aeroflutter.studies.sampled",
        "aeroflutter.studies.maps.flutter_map",
        "aeroflutter.studies.maps.sweep",
    )
