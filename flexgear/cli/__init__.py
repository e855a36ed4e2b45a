"""Command line: orders work from the layers below and shows what came of it."""

from flexgear.cli.entry import main

__all__ = ["main"]
