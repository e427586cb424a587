"""`aeroflutter warmup`."""

from __future__ import annotations

from aeroflutter.cli.common import Json, print_json, say


def warmup(*, json: Json = False) -> None:
    """Compile everything that is compiled on first use, so that no later command has to.

    The machine code is kept in NUMBA_CACHE_DIR where that is set, else in the user's folder for
    caches; once for each version of the program and of its compiler.
    """
    from aeroflutter.kernels.warmup import warm_up

    made = warm_up()
    if json:
        print_json(made._asdict())
        return
    count = made.compiled + made.kept
    if not count:
        say("nothing to compile: NUMBA_DISABLE_JIT is set")
    elif not made.compiled:
        say(f"all {count} kernels are there already: {made.folder}")
    else:
        say(f"{made.compiled} of {count} kernels compiled in {made.seconds:.1f} s")
        if made.folder:
            say(f"kept in {made.folder}")
