"""Pages of what is called from outside: environments, commands, documents, modules."""

from __future__ import annotations

import inspect
import io
import os
import re
from contextlib import redirect_stdout, suppress

import gymnasium
from gymnasium.envs.registration import load_env_creator

import envs
from bench.cli import COMMANDS, main
from bench.cli.schema import KINDS, generated

WIDTH = "100"
"""Columns of the help texts."""


def environments() -> dict[str, str]:
    """A page for each environment, from the text of its class."""
    index = [
        "# Environments",
        "",
        "Each asks what to exert so that a record tells most.",
        "",
        "| id | question |",
        "|---|---|",
    ]
    made = {}
    for identifier in envs.IDS:
        slug = identifier.partition("/")[2]
        text = inspect.getdoc(load_env_creator(str(gymnasium.spec(identifier).entry_point))) or ""
        question = text.partition("\n")[0]
        index.append(f"| [`{identifier}`]({slug}.md) | {question} |")
        # rst's double backquotes are Markdown's single ones
        made[f"reference/environments/{slug}.md"] = f"# {identifier}\n\n{text.replace('``', '`')}\n"
    return {"reference/environments/index.md": "\n".join([*index, ""])} | made


def _help(words: list[str]) -> str:
    """What `jointbench … --help` prints, without colours and boxes that depend on the terminal."""
    os.environ.update(COLUMNS=WIDTH, NO_COLOR="1", TERM="dumb")
    printed = io.StringIO()
    with redirect_stdout(printed), suppress(SystemExit):
        main([*words, "--help"])
    text = re.sub(r"\x1b\[[0-9;]*m", "", printed.getvalue())
    return "\n".join(line.rstrip() for line in text.strip().splitlines())


def _subcommands(text: str) -> list[str]:
    found = re.search(r"usage: .*?\{([a-z,_-]+)\}", text, re.DOTALL)
    return found.group(1).split(",") if found else []


def commands() -> dict[str, str]:
    """The page of all commands, from their help."""
    lines = [
        "# Commands",
        "",
        "What `jointbench COMMAND --help` prints. Exit status: 0 done, 2 refused in one line, 130 stopped by hand.",
        "",
    ]
    for command in COMMANDS:
        text = _help([command])
        lines += [f"## jointbench {command}", "", "```text", text, "```", ""]
        for sub in _subcommands(text):
            lines += [f"### jointbench {command} {sub}", "", "```text", _help([command, sub]), "```", ""]
    return {"reference/commands.md": "\n".join(lines)}


def documents() -> dict[str, str]:
    """The page of the documents, from their models."""
    lines = [
        "# Documents",
        "",
        "JSON and TOML files that people and programs write. `jointbench schema NAME -o FILE` writes the whole schema of one, for an editor.",
        "",
    ]
    for name, kind in KINDS.items():
        schema = generated(name)
        needed = set(schema.get("required", ()))
        lines += [
            f"## {name}",
            "",
            f"{kind.about[0].upper()}{kind.about[1:]}.",
            "",
            "| entry | needed | meaning |",
            "|---|---|---|",
        ]
        for entry, value in schema.get("properties", {}).items():
            about = " ".join(str(value.get("description", value.get("title", ""))).split()).replace(
                "|", "\\|"
            )
            lines.append(f"| `{entry}` | {'yes' if entry in needed else '–'} | {about} |")
        lines.append("")
    return {"reference/documents.md": "\n".join(lines)}
