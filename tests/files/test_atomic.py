"""Files and folders that appear whole or stay as they were."""

import errno
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from flexgear.files.atomic import staged_folder, try_file, write_bytes, write_json
from flexgear.model.errors import FlexgearError, InputError

posix = pytest.mark.skipif(sys.platform == "win32", reason="as on POSIX systems")


def may_mount():
    """Whether this user may mount a file system where nobody else sees it."""
    if shutil.which("unshare") is None:
        return False
    return subprocess.run(["unshare", "-m", "true"], capture_output=True).returncode == 0


def test_files_move_in_at_the_end_and_replace_older_ones(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "a.txt").write_text("old")
    (out / "mine.txt").write_text("kept")
    with staged_folder(out) as stage:
        (stage / "deep").mkdir()
        (stage / "a.txt").write_text("new")
        (stage / "deep" / "b.txt").write_text("b")
        assert (out / "a.txt").read_text() == "old"
    assert (out / "a.txt").read_text() == "new"
    assert (out / "deep" / "b.txt").read_text() == "b"
    assert (out / "mine.txt").read_text() == "kept"
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def results(folder, **texts):
    for name, text in texts.items():
        file = folder / name.replace("__", "/").replace("_", ".")
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)


def contents(folder):
    return {str(f.relative_to(folder)): f.read_text() for f in folder.rglob("*") if f.is_file()}


def of_results(folder):
    return [f for name in ("[!.]*.nc", "pictures/*", "summary.json") for f in folder.glob(name)]


def test_outdated_files_go_with_those_that_replace_them(tmp_path):
    """All of the earlier results, with the folder that they leave empty; other files stay."""
    results(tmp_path, a_nc="old", b_nc="old", pictures__a_png="old", summary_json="old", my_txt="")
    with staged_folder(tmp_path, of_results) as stage:
        results(stage, a_nc="new", summary_json="new")
    assert contents(tmp_path) == {"a.nc": "new", "summary.json": "new", "my.txt": ""}
    assert not (tmp_path / "pictures").exists()


@pytest.mark.parametrize("fails", ["a.nc", "b.nc", "c.nc", "summary.json"])
@pytest.mark.parametrize("direction", ["away", "in"])
def test_a_folder_is_as_it_was_where_a_file_cannot_be_moved(
    tmp_path, monkeypatch, fails, direction
):
    """Whichever file refuses, on its way out or in; new results are kept."""
    out = tmp_path / "out"
    old = {"a_nc": "old", "b_nc": "old", "c_nc": "old", "pictures__a_png": "old"}
    out.mkdir()
    results(out, **old, summary_json="old")
    before, real = contents(out), os.replace

    def refuses(source, target):
        place = "away" if Path(source).parent == out else "in"
        restored = "replaced" in Path(source).parts
        if Path(source).name == fails and place == direction and not restored:
            raise OSError(errno.EACCES, os.strerror(errno.EACCES))
        return real(source, target)

    def work():
        with monkeypatch.context() as patch, staged_folder(out, of_results) as stage:
            results(stage, a_nc="new", b_nc="new", c_nc="new", summary_json="new")
            patch.setattr(os, "replace", refuses)

    with pytest.raises(FlexgearError, match="Permission denied") as caught:
        work()
    folder = Path(str(caught.value).partition("kept as ")[2])
    assert contents(folder)["summary.json"] == "new"
    shutil.rmtree(folder.parent)
    assert contents(out) == before


KILLED_WHILE_MOVING = """
import os, sys
from pathlib import Path
from flexgear.files.atomic import staged_folder

def work(out, moment):
    real, moves = os.replace, iter(range(moment))
    def replace(source, target):
        if next(moves, None) is None:
            os._exit(9)
        real(source, target)
    with staged_folder(out, lambda folder: folder.glob("[!.]*.*")) as stage:
        for name in ("a.nc", "b.nc", "summary.json"):
            (stage / name).write_text("new")
        os.replace = replace

for moment in range(7):
    child = os.fork()
    if not child:
        work(Path(sys.argv[1]) / str(moment), moment)
        os._exit(0)
    os.waitpid(child, 0)
"""


@posix
def test_a_kill_while_files_move_never_leaves_two_sets_that_pass_for_one(tmp_path):
    """Three files go, three come; whenever the kill is: old results, new ones, or unfinished."""
    folders = [tmp_path / str(moment) for moment in range(7)]
    for folder in folders:
        folder.mkdir()
        results(folder, a_nc="old", c_nc="old", summary_json="old")
    subprocess.run([sys.executable, "-c", KILLED_WHILE_MOVING, tmp_path], check=True)
    texts = [{f.name: f.read_text() for f in o.iterdir() if f.is_file()} for o in folders]
    finished = [set(files.values()) for files in texts if "summary.json" in files]
    assert finished == [{"old"}, {"new"}]
    assert len(texts[-1]) == 3


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError, FlexgearError])
def test_a_block_that_fails_leaves_nothing(tmp_path, error):
    def fill(stage):
        (stage / "a.txt").write_text("new")
        raise error

    with pytest.raises(error), staged_folder(tmp_path / "out") as stage:
        fill(stage)
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_way(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(FlexgearError, match="name a folder"), staged_folder(tmp_path / "out"):
        pass


def test_json_holds_no_nan(tmp_path):
    with pytest.raises(ValueError, match="JSON"):
        write_json(tmp_path / "a.json", {"a": float("nan")})
    assert list(tmp_path.iterdir()) == []


KILLED = """
import os, sys
from flexgear.files.atomic import staged_folder
with staged_folder(sys.argv[1]) as stage:
    (stage / "half.txt").write_text("half")
    os._exit(9)
"""


@posix
def test_leftovers_of_a_killed_process_are_removed_by_the_next_one(tmp_path):
    out = tmp_path / "out"
    subprocess.run([sys.executable, "-c", KILLED, out], check=False)
    assert [p.suffix for p in tmp_path.iterdir()] == [".partial"]
    with staged_folder(out) as mine:
        (mine / "a.txt").write_text("a")
        with staged_folder(out) as other:  # which does not take this one for a stale one
            (other / "b.txt").write_text("b")
        assert mine.is_dir()
        subprocess.run([sys.executable, "-c", KILLED, out], check=False)  # staged within
    with staged_folder(out):
        pass
    assert sorted(p.name for p in out.iterdir()) == ["a.txt", "b.txt"]
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_somebody_elses_hidden_folders_stay(tmp_path):
    (tmp_path / ".mine.partial").mkdir()
    (tmp_path / ".out.01234567.partial").mkdir()
    (tmp_path / ".out.01234567.partial" / "kept.txt").write_text("finished work")
    with staged_folder(tmp_path / "out"):
        pass
    assert len(list(tmp_path.iterdir())) == 3


IN_A_MOUNT = """
import os, subprocess, sys
from pathlib import Path
from flexgear.files.atomic import staged_folder, write_bytes
out = Path(sys.argv[1])
subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", out], check=True)
with staged_folder(out) as stage:
    (stage / "deep").mkdir()
    (stage / "deep" / "a.txt").write_text("new")
assert [p.name for p in out.rglob("*")] == ["deep", "a.txt"]
write_bytes(out / "b.txt", b"b")
try:
    with staged_folder(out) as stage:
        (stage / "a.txt").write_bytes(bytes(100_000))
except OSError as error:
    print(error.strerror)
print(sorted(p.name for p in out.iterdir()))
"""


@pytest.mark.skipif(not may_mount(), reason="this user may not mount")
def test_the_root_of_a_mounted_device(tmp_path):
    command = ["unshare", "-m", sys.executable, "-c", IN_A_MOUNT, tmp_path]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == ["No space left on device", "['b.txt', 'deep']"]


def refuse(monkeypatch, *names, refused=lambda source, target: True):
    """Make renaming fail as across devices."""
    for name in names:
        real = getattr(os, name)

        def fake(source, target, real=real):
            if refused(Path(source), Path(target)):
                raise OSError(errno.EXDEV, os.strerror(errno.EXDEV))
            return real(source, target)

        monkeypatch.setattr(os, name, fake)


def test_a_device_that_does_not_rename_is_found_before_the_work(tmp_path, monkeypatch):
    refuse(monkeypatch, "rename", "replace")
    began = []
    with (
        pytest.raises(FlexgearError, match=r"out: Invalid cross-device link$"),
        staged_folder(tmp_path / "out"),
    ):
        began.append(1)
    with pytest.raises(FlexgearError, match=r"a\.nc: Invalid cross-device link$"):
        try_file(tmp_path / "new" / "a.nc")
    assert not began
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("exists", [False, True])
def test_finished_work_that_cannot_be_moved_is_kept_and_named(tmp_path, monkeypatch, exists):
    out = tmp_path / "out"
    if exists:
        out.mkdir()
    with monkeypatch.context() as patch:
        refuse(patch, "rename", "replace", refused=lambda s, t: "files" in (s.name, s.parent.name))
        with pytest.raises(FlexgearError) as caught, staged_folder(out) as stage:
            (stage / "a.txt").write_text("hours of work")
    for _ in range(2):  # it outlives the next run, too
        folder = Path(str(caught.value).partition("kept as ")[2])
        assert (folder / "a.txt").read_text() == "hours of work"
        with staged_folder(out):
            pass


def test_a_finished_file_that_cannot_be_moved_is_kept_and_named(tmp_path, monkeypatch):
    refuse(monkeypatch, "replace")
    with pytest.raises(FlexgearError, match="Invalid cross-device link") as caught:
        write_bytes(tmp_path / "a.nc", b"hours of work")
    assert Path(str(caught.value).partition("kept as ")[2]).read_bytes() == b"hours of work"


@pytest.fixture
def hears_ctrl_c():
    """Also where the tests run in the background of a shell, whose children ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@posix
@pytest.mark.usefixtures("hears_ctrl_c")
def test_ctrl_c_while_files_are_moved_waits_for_the_last_one(tmp_path, monkeypatch):
    (tmp_path / "a.txt").write_text("old")
    real = os.replace

    def pressed(source, target):
        if Path(target).parent == tmp_path and Path(target).suffix == ".txt":
            os.kill(os.getpid(), signal.SIGINT)
        return real(source, target)

    def work():
        with monkeypatch.context() as patch, staged_folder(tmp_path) as stage:
            for name in "ab":
                (stage / f"{name}.txt").write_text("new")
            patch.setattr(os, "replace", pressed)

    with pytest.raises(KeyboardInterrupt):
        work()
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"a.txt": "new", "b.txt": "new"}


@posix
def test_links_are_followed(tmp_path):
    (tmp_path / "store").mkdir()
    (tmp_path / "store" / "a.txt").write_text("old")
    (tmp_path / "a.txt").symlink_to("store/a.txt")
    (tmp_path / "out").symlink_to("store")
    write_bytes(tmp_path / "a.txt", b"new")
    with staged_folder(tmp_path / "out") as stage:
        (stage / "b.txt").write_text("b")
    texts = {p.name: p.read_text() for p in (tmp_path / "store").iterdir()}
    assert texts == {"a.txt": "new", "b.txt": "b"}
    assert (tmp_path / "a.txt").is_symlink() and (tmp_path / "out").is_symlink()


@pytest.mark.parametrize(
    "name", ["", ".", "..", "new/", "folder", "f/a.nc", "/dev/null", "x" * 300]
)
def test_names_that_no_file_can_have_are_refused(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "f").write_text("")
    for write in (try_file, lambda path: write_bytes(path, b"")):
        with pytest.raises(InputError):
            write(name)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["f", "folder"]
    assert Path("/dev/null").is_char_device()


def test_long_and_odd_names(tmp_path):
    for name in ("x" * 255, os.fsdecode(b"\xff\xfe.nc"), "new\nline"):
        assert write_bytes(tmp_path / name, b"1").read_bytes() == b"1"
        with staged_folder(tmp_path / "deep" / name) as stage:
            (stage / "a").write_text("")
        assert (tmp_path / "deep" / name / "a").is_file()
