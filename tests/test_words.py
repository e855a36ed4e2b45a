"""Words of the code and the manual are those of the field: names say what a value holds."""

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.load import with_list
from flexgear.model.read import to_si

ROOT = Path(__file__).resolve().parents[1]
NAMES = {"found", "told", "said", "kept"}  # of anything; what holds them says nothing
LOCAL_NAMES = NAMES | {  # of variables and arguments
    "own", "given", "known", "wanted", "made", "it", "them", "these", "here", "there", "apart",
}  # fmt: skip
PHRASES = re.compile(
    r"as it should be|\bstray\b|\bladder\b|lost its mates|way off the axis|under way"
    r"|hu-2023|ren-2021|at hand\b",
    re.IGNORECASE,
)
EXEMPT = {  # a key of ``doctor --json``
    ("flexgear/cli/system_commands.py", "found"),
}
BUILT = {"_build", "_generated"}  # by Sphinx, beside the pages


def sources(*folders: str) -> list[Path]:
    files = [path for folder in folders for path in (ROOT / folder).rglob("*.py")]
    return sorted(path for path in files if not BUILT & {*path.parts})


def manual() -> list[Path]:
    pages = [p for p in (ROOT / "docs").rglob("*.md") if not BUILT & {*p.parts}]
    return sorted([*pages, ROOT / "README.md"])


def names_of(path: Path) -> Iterator[tuple[str, bool, int]]:
    """Names that a file gives, whether to a variable or an argument, and their lines."""
    tree = ast.parse(path.read_text())
    fields = {
        id(item.target)
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
        for item in node.body
        if isinstance(item, ast.AnnAssign)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name.strip("_").lower(), False, node.lineno
        elif isinstance(node, ast.arg):
            yield node.arg, True, node.lineno
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id, id(node) not in fields, node.lineno


def test_no_name_is_a_participle_that_says_nothing():
    wrong = [
        f"{path.relative_to(ROOT)}:{line}: {name}"
        for path in sources("flexgear", "tests", "validation", "docs")
        for name, local, line in names_of(path)
        if name in (LOCAL_NAMES if local else NAMES)
        if (path.relative_to(ROOT).as_posix(), name) not in EXEMPT
    ]
    assert not wrong, "\n".join(wrong)


def test_texts_have_no_private_words():
    wrong = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in [*sources("flexgear"), *manual()]
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if PHRASES.search(line)
    ]
    assert not wrong, "\n".join(wrong)


def test_keys_of_the_manual_exist():
    """Blocks may be parts of a case, such as a machine below an input that is not printed."""
    wrong = []
    for page in manual():
        for block in re.findall(r"```toml\n(.*?)```", page.read_text("utf-8"), re.DOTALL):
            try:
                to_si(Case, with_list(tomllib.loads(block), page.name), page.name, {})
            except InputError as fault:
                wrong += [str(fault)] if fault.problem != "is not a list" else []
    assert not wrong
