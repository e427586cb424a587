"""What `map` and `sweep` share: who computes, where results are kept, how a stopped run goes on."""

from __future__ import annotations

import contextlib
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.cli.common import name_problems
from aeroflutter.cli.streams import printable
from aeroflutter.errors import AeroflutterError, InputError
from aeroflutter.limits import within
from aeroflutter.stderr import aside

if TYPE_CHECKING:
    from aeroflutter.case import Case
    from aeroflutter.studies.maps import Executor


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Keeping:
    """Who computes, and where the results are kept."""

    workers: Annotated[
        int | None,
        Parameter(
            help="Worker processes; 0 computes in this process. By default one a core, or no "
            "process but this one where the work is small."
        ),
    ] = None
    scheduler: Annotated[
        str | None,
        Parameter(help="Compute on the Dask scheduler at this address, tcp://HOST:PORT."),
    ] = None
    out: Annotated[
        Path | None,
        Parameter(
            help="Keep the results in this zarr store (.zarr), or in a NetCDF file (.nc) and the "
            "store of the same name beside it."
        ),
    ] = None
    resume: Annotated[
        bool,
        Parameter(negative=(), show_default=False, help="Go on with the store of --out."),
    ] = False
    overwrite: Annotated[
        bool,
        Parameter(negative=(), show_default=False, help="Replace what --out names."),
    ] = False

    @property
    def store(self) -> Path | None:
        """The zarr store."""
        if self.out is None or self.out.suffix == ".zarr":
            return self.out
        return self.out.with_suffix(".zarr")

    @property
    def netcdf(self) -> Path | None:
        """The NetCDF file."""
        return None if self.out == self.store else self.out

    def check(self) -> None:
        """Refuse what cannot be, before any work is done.

        Raises
        ------
        InputError
            For a suffix that is neither, a file that is there, or options that exclude others.
        """
        if self.out is None:
            if self.resume or self.overwrite:
                flag = "--resume" if self.resume else "--overwrite"
                raise InputError(f"{flag}: name the store with --out")
            return
        if self.resume and self.overwrite:
            raise InputError("--resume: excludes --overwrite; give one of the two")
        if self.out.suffix not in (".nc", ".zarr"):
            raise InputError(f"--out {self.out}: must end in .zarr or .nc")
        problems = name_problems("--out", self.out)
        if problems:
            raise InputError(problems)
        if not self.out.parent.is_dir():
            raise InputError(
                f"--out {self.out}: there is no folder {self.out.parent}; create it first"
            )
        if self.netcdf and self.netcdf.exists() and not (self.resume or self.overwrite):
            raise InputError(
                f"{self.netcdf}: exists; give another name, --resume to go on with its store, "
                "or --overwrite to replace it"
            )

    def executor(self, *, threads: bool = False, alone: bool = False) -> Executor:
        """Who computes.

        Parameters
        ----------
        threads, alone
            What to take where the user does not say: threads of this process, or one of them.

        Raises
        ------
        InputError
            If the number of workers is negative, or a scheduler is given as well.
        """
        from aeroflutter.studies.maps import Cluster, Processes, Threads
        from aeroflutter.studies.maps.executors import cores

        if self.scheduler is not None:
            if self.workers is not None:
                raise InputError("--workers: excludes --scheduler, which has workers of its own")
            return Cluster(self.scheduler)
        if self.workers is None:
            if alone or threads:
                return Threads(1 if alone else cores())
            return Processes(cores())
        if self.workers < 0:
            raise InputError(f"--workers: must be zero or more, not {self.workers}")
        within("workers", self.workers, "--workers")
        return Processes(self.workers) if self.workers else Threads(1)

    def opened(self, study: Any, case: Case) -> Any:
        """The results of a study as a context: the store, or memory."""
        from aeroflutter.studies.maps import Store
        from aeroflutter.studies.maps.results import MemoryResults

        if self.store is None:
            return contextlib.nullcontext(MemoryResults(study))
        if self.resume:
            resumed = Store.resume(self.store, study)
            for line in resumed.mended:
                aside(printable(f"{self.store}: {line}"))
            return contextlib.closing(resumed)
        from aeroflutter.results.dataset import VARIABLES, provenance

        store = Store.create(self.store, study, overwrite=self.overwrite)
        store.annotate(provenance(case), VARIABLES)
        return contextlib.closing(store)


def compute(study: Any, results: Any, executor: Executor, unit: str) -> None:
    """Run a study with its progress on stderr; an interrupted run says how to go on."""
    from aeroflutter.cli.progress import progress
    from aeroflutter.studies.maps import Cluster, Store, run

    if not isinstance(executor, Cluster):
        study.warm_up()
    try:
        with progress(unit) as report:
            run(study, results, executor, report)
    except (KeyboardInterrupt, AeroflutterError, OSError) as stop:
        if isinstance(results, Store):
            how = "interrupted" if isinstance(stop, KeyboardInterrupt) else "stopped"
            aside(printable(_how_to_resume(how, results)))
        raise


def _how_to_resume(how: str, store: Any) -> str:
    done = sum(int(store.done(phase).sum()) for phase in store.study.phases)
    total = sum(store.done(phase).size for phase in store.study.phases)
    words = [word for word in sys.argv[1:] if word not in ("--resume", "--overwrite")]
    command = shlex.join(["aeroflutter", *words, "--resume"])
    return f"{how}: {done} of {total} blocks are safe in {store.path}; go on with\n  {command}"
