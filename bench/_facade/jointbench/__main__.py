"""``python -m jointbench``."""

from jointbench import _own


def main() -> None:
    """Run the command line."""
    _own.own("bench")
    from bench.cli import main as run  # noqa: PLC0415  (after it is sure which `bench`)

    run()


if __name__ == "__main__":
    main()
