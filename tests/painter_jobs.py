"""Work for a helper process, which has to find it in a module."""

import os
import time
from dataclasses import dataclass


@dataclass(frozen=True)
class Wall:
    """Something to paint; ``owner`` is the process that the painter belongs to."""

    owner: int
    colours: tuple[str, ...] = ()


def wall(pieces):
    return Wall(pieces[0], tuple(pieces[1:]))


def who(content, name):
    """Which process did it, and with what."""
    time.sleep(0.05)
    return os.getpid(), content.colours


def dies_elsewhere(content, name):
    if os.getpid() != content.owner:
        os._exit(3)
    return name


def fails_elsewhere(content, name):
    if os.getpid() != content.owner:
        raise OSError("not here")
    return name


def fails(content, name):
    raise ValueError(name)


def never_ends(content, name):
    time.sleep(600 if os.getpid() != content.owner else 0)
    return name
