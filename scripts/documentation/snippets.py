"""The fenced examples of README and docs: found, and run page by page as a reader would.

Blocks of one page run one after the other in one folder, Python in one namespace. A block that cannot run says why in the
line before it: ``<!-- not run: needs a cluster -->``; one that takes long, ``<!-- slow -->``, runs where all are asked for.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parents[2]
FENCE = re.compile(
    r"(?:<!-- (?P<mark>not run: [^>]+|slow) -->\n)?^```(?P<language>python|sh|shell|bash)\n(?P<code>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
COMMANDS = ("jointbench", "python", "cp", "cat")
"""What a shell block may call; another command needs a reason not to be run."""


@dataclass(frozen=True)
class Snippet:
    """A fenced example.

    Attributes:
        page: The page.
        line: Line of its first line of code.
        language: "python" or "sh".
        code: The code.
        reason: Why it is not run; empty where it is.
        slow: Run only where all are asked for.
    """

    page: Path
    line: int
    language: str
    code: str
    reason: str = ""
    slow: bool = False


def pages() -> list[Path]:
    """README and all pages written by hand."""
    written = [
        p for p in sorted((ROOT / "docs").rglob("*.md")) if "reference" not in p.relative_to(ROOT).parts
    ]
    return [ROOT / "README.md", *written]


def snippets(page: Path) -> Iterator[Snippet]:
    """The examples of a page in order."""
    text = page.read_text(encoding="utf-8")
    for found in FENCE.finditer(text):
        mark = found["mark"] or ""
        line = text.count("\n", 0, found.start("code")) + 1
        language = "python" if found["language"] == "python" else "sh"
        reason = mark.removeprefix("not run: ") if mark.startswith("not run") else ""
        yield Snippet(page, line, language, found["code"], reason, mark == "slow")


def _shell(code: str, folder: Path) -> None:
    """Run the lines of a shell block, `jointbench` and `python` being those of this interpreter."""
    joined = code.replace("\\\n", " ")
    for line in filter(None, (line.split(" #")[0].strip() for line in joined.splitlines())):
        words = shlex.split(line)
        if words[0] not in COMMANDS:
            raise ValueError(f"'{line}': no command that examples are run with; say why it is not run")
        own = {"jointbench": [sys.executable, "-m", "bench.cli"], "python": [sys.executable]}
        environment = os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "100"}
        done = subprocess.run(
            [*own.get(words[0], [words[0]]), *words[1:]],
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            raise ValueError(f"'{line}' ended with {done.returncode}: {done.stderr.strip()[-600:]}")


def run_page(page: Path, folder: Path, *, slow: bool) -> int:
    """Run the examples of a page in a folder.

    Args:
        page: The page.
        folder: An empty folder; the examples of the checkout are linked into it.
        slow: Also those that take long.

    Returns:
        How many ran.

    Raises:
        ValueError: A block failed; the message says which line.
    """
    for name in ("examples", "scripts"):
        if not (folder / name).exists():
            (folder / name).symlink_to(ROOT / name)
    # a module and a file of its own: compiled kernels are found again by them
    module = sys.modules["example"] = ModuleType("example")
    module.__file__ = str(folder / "example.py")
    before, count = Path.cwd(), 0
    for snippet in snippets(page):
        if snippet.reason or (snippet.slow and not slow):
            continue
        os.chdir(folder)
        try:
            if snippet.language == "python":
                code = "\n" * (snippet.line - 1) + snippet.code
                Path(module.__file__).write_text(code, encoding="utf-8")
                exec(compile(code, module.__file__, "exec"), module.__dict__)
            else:
                _shell(snippet.code, folder)
        except Exception as error:
            raise ValueError(
                f"{page.relative_to(ROOT)}:{snippet.line}: {type(error).__name__}: {error}"
            ) from error
        finally:
            os.chdir(before)
        count += 1
    return count
