"""The page of the command line: every command of `adcs` with its arguments and options, from the commands."""

import re
from collections.abc import Iterator
from typing import Any

import typer
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from cosim.cli.commands import app

HEAD = """# Command line

`python -m cosim` does the same as `adcs`. Exit status 0: done; 1: a simulation ended early, what was recorded is kept;
2: a mistake in what was asked for.

"""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the page."""
    group: Any = typer.main.get_command(app)
    text = HEAD + "\n".join(part for name in group.commands for part in _command(name, group.commands[name]))
    files.append(File.generated(config, "command_line.md", content=text))
    return files


def _command(name: str, command: Any) -> Iterator[str]:
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    options = [p for p in command.params if p.param_type_name == "option" and not p.hidden]
    shown = " ".join(_names(p).strip("`") + ("..." if p.nargs == -1 else "") for p in arguments)
    yield f"## adcs {name}\n"
    yield f"```text\nadcs {name} {shown} [OPTIONS]\n```\n"
    yield f"{_plain(command.help)}\n"
    if arguments or options:
        yield "| argument or option | what it does |\n| --- | --- |"
        for p in (*arguments, *options):
            yield f"| {_names(p)} | {_plain(p.help)}{_default(p)} |"
        yield ""


def _names(parameter: Any) -> str:
    if parameter.param_type_name == "argument":
        return f"`{parameter.name.upper()}`"
    return ", ".join(f"`{name}`" for name in (*parameter.opts, *parameter.secondary_opts))


def _default(parameter: Any) -> str:
    value = parameter.default
    return f" (`{value}`)" if value not in (None, False, (), []) and not callable(value) else ""


def _plain(text: str | None) -> str:
    """Return a help text in which names like I=X and *.J stay as typed."""
    return re.sub(r"([*_<\[\]|])", r"\\\1", " ".join((text or "").split()))
