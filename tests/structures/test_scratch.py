"""Arrays on disk."""

import errno
import os
import tempfile

import numpy as np
import pytest

from flexgear.model.errors import FlexgearError
from flexgear.structures.scratch import scratch_array


def test_keeps_what_is_written_and_leaves_no_file(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    array = scratch_array((300, 7))
    expected = np.arange(2100.0).reshape(300, 7)
    array[:] = expected
    assert not list(tmp_path.iterdir())
    assert np.array_equal(array, expected)


def test_a_full_disk_is_one_line(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(os, "posix_fallocate", full)
    with pytest.raises(FlexgearError, match=r"no room for 0\.8 GB.*TMPDIR") as caught:
        scratch_array((1000, 100_000))
    assert str(tmp_path) in str(caught.value)
