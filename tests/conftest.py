"""For all tests: properties are judged by what they find, not by how long a busy machine takes.

In CI the examples are the same at every call: what is merged is not judged by a throw of dice.
Everywhere else they are new ones; what they find is a fault all the same.
"""

import os

from hypothesis import settings

settings.register_profile("flexgear", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("flexgear")
