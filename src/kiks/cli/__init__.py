"""The command `kiks`."""

from __future__ import annotations

import os
import sys
from contextlib import suppress

import typer

from kiks.cli.arena import arena
from kiks.cli.calibrate import calibrate
from kiks.cli.champion import champion
from kiks.cli.command_line import command_group
from kiks.cli.compare import compare
from kiks.cli.desk import desk
from kiks.cli.doctor import doctor
from kiks.cli.evolve import evolve
from kiks.cli.examples import DemoCommand, examples
from kiks.cli.exercise import exercise
from kiks.cli.export import export
from kiks.cli.fit import fit
from kiks.cli.grade import grade
from kiks.cli.host import host
from kiks.cli.matlab import matlab
from kiks.cli.monitor import monitor
from kiks.cli.options import show_log, with_options
from kiks.cli.outputs import Command
from kiks.cli.replay import replay
from kiks.cli.room import room
from kiks.cli.run import RunCommand, run
from kiks.cli.schema import schema
from kiks.cli.serve import serve
from kiks.cli.session import session
from kiks.cli.sweep import sweep
from kiks.cli.tournament import tournament
from kiks.cli.warmup import warmup
from kiks.ending import INTERRUPTED, leave_threads, tell
from kiks.errors import KiksError
from kiks.ports.resources import raise_limit
from kiks.version import __version__

DEMO_HELP = """Run a demonstration, or list them.

A demonstration is a program in a world of its own, and leaves a picture, kiks-NAME.png; with --desk you watch it
instead.

Example: kiks demo avoid --desk

Example: kiks demo follow --arena office --seconds 300"""

app = command_group(
    "KiKS Is a Khepera Simulator: programs for a real Khepera robot run on a simulated one, unchanged.",
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
)
for _command in (
    desk,
    run,
    grade,
    examples,
    evolve,
    champion,
    sweep,
    tournament,
    compare,
    replay,
    export,
    serve,
    room,
    host,
    matlab,
    session,
    monitor,
    calibrate,
    fit,
    schema,
    warmup,
    doctor,
):
    app.command(cls=RunCommand if _command is run else Command)(with_options(_command))
    if _command is run:
        app.command("demo", cls=DemoCommand, help=DEMO_HELP)(with_options(run))
app.add_typer(arena, name="arena")
app.add_typer(exercise, name="exercise")


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"KiKS {__version__}")
        raise typer.Exit


WELCOME = f"""KiKS {__version__}: programs for a Khepera robot drive a simulated one. Try:

  kiks demo avoid --desk      watch a robot in the browser, and drag it about
  kiks run my_program.py      run a program of yours that talks to a Khepera with pyserial
  kiks examples first         get programs and arenas to change, in the folder first

kiks -h lists all commands, kiks COMMAND -h explains one."""


@app.callback(invoke_without_command=True)
def _options(
    context: typer.Context,
    version: bool = typer.Option(
        False, "--version", "-V", callback=_print_version, is_eager=True, help="Show the version."
    ),
) -> None:
    show_log(is_quiet=True)
    if context.invoked_subcommand is None:
        typer.echo(WELCOME)


def main() -> None:
    """Run the command; a mistake of the user ends in one clear message."""
    raise_limit()
    try:
        app()
    except KiksError as error:
        typer.echo(f"kiks: {error}", err=True)
        sys.exit(2)
    except OSError as error:
        # The error of a file has its own line; this is one of the standard output, such as a full disk.
        tell(f"Cannot go on: {error.strerror or error}. Is there room for the output?")
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what is still in its buffer
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except SystemExit as leaving:
        if leaving.code == INTERRUPTED:
            leave_threads()
        raise
