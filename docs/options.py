"""Write docs/options.md, every option of every command: `python docs/options.py`."""

from pathlib import Path

PAGE = Path(__file__).with_name("options.md")
ABOVE = """\
# Options

Every option of the command line, what it means and which commands take it; `aeroflutter COMMAND
--help` describes those of one. Airspeeds have one vocabulary: `--speed-ratio` (U\\*/U\\*_L),
`--speed` (U\\*) and `--velocity` (m/s, where the case has SI data); ranges of numbers are `A:B:N`,
both ends included, or `a,b,c`. Former names of options go on working, with a warning that says the
name of today.

Degrees are for angles. Where the first spring of a case is in m, or in semichords, options that end
in `-deg` take its unit; what is told then has names without `_deg` (`amplitude`), and
`amplitude_deg` is null.

What is there is not lost. `--out` replaces a file only where it holds an earlier result of the
same command and case, and says `replaced`; anything else, case files among it, stays unless
`--overwrite` is given. `map` and `sweep`, whose results may have taken hours, keep even their own:
`--resume` goes on with them. Figures (`--plot`) are drawn anew.

| option | commands | meaning |
| --- | --- | --- |
"""


def options() -> dict[str, dict[str, list[str]]]:
    """Commands by option and meaning."""
    from aeroflutter.cli import COMMANDS, build_app

    app, found = build_app(), {}
    for command in COMMANDS:
        for argument in app[command].assemble_argument_collection():
            name = argument.names[0]
            if not argument.show or not name.startswith("--") or name == "--case":
                continue
            meaning = " ".join((argument.parameter.help or "").split()).replace("|", "/")
            found.setdefault(name, {}).setdefault(meaning, []).append(command)
    return found


def page() -> str:
    """The text of the page."""
    lines = [
        f"| `{name}` | {', '.join(f'`{command}`' for command in commands)} | {meaning} |"
        for name, meanings in sorted(options().items())
        for meaning, commands in meanings.items()
    ]
    return ABOVE + "\n".join(lines).replace("*", "\\*") + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
