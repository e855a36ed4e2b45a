"""Commands compile loops quickly, unless the user asks for more."""

import os
import subprocess
import sys

import pytest

COMMAND = """
from flexgear.cli import main
try:
    main(["cases", "lin-parker"])
finally:
    import numba
    print("level", int(numba.config.OPT))
"""


@pytest.mark.parametrize(("asked", "level"), [(None, 1), ("3", 3)])
def test_numba_optimises_at_the_level_of_commands_or_of_the_user(asked, level):
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_OPT"}
    if asked is not None:
        environment["NUMBA_OPT"] = asked
    done = subprocess.run(
        [sys.executable, "-c", COMMAND], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == f"level {level}"
