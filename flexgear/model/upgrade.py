"""Conversion of case files of earlier versions.

Up to 0.2.0 a file had a ``kind``, and a single flexible stage could be written with top-level
sections, which ``MOVES`` maps to keys of the stage and its ports. By default its carrier was the
input, its sun the output, and its ring was held.
"""

import re
import shlex
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from flexgear.model.errors import InputError
from flexgear.model.read import parse_toml

MOVES = (  # earlier key, present key; longer keys come before their prefixes
    ("ring", "stage.ring.fe"),
    ("carrier", "stage.carrier.fe"),
    ("shaft", "stage.sun.shaft"),
    ("bearings.planet", "stage.planet_bearing"),
    ("bearings.carrier_drive", "stage.carrier.bearing_drive"),
    ("bearings.carrier_far", "stage.carrier.bearing_far"),
    ("bearings.sun", "stage.sun.support"),
    ("bearings.output", "output.bearing"),
    ("inertia.drive", "inputs.0.inertia"),
    ("inertia.output_mass", "output.mass"),
    ("inertia.output_tilt", "output.tilt_inertia"),
    ("inertia.output", "output.inertia"),
    ("drive.rated_torque", "inputs.0.torque"),
    ("drive.rated_speed", "inputs.0.speed"),
    ("brake.exponent", "output.brake_exponent"),
    ("brake.rated_torque", "output.brake_torque"),
    ("gear_mesh", "stage.gear_mesh"),
    ("errors", "stage.errors"),
)
_REMOVED = ("bearings", "inertia", "brake")  # sections of which all keys have moved
_SPLIT = (*_REMOVED, "drive")  # sections whose keys move to several sections
_PORTS = {"inputs.0": "stage.carrier", "output": "stage.sun"}  # default members
_HEADER = re.compile(r"(\s*\[+)([^\]]*)(\]+)([ \t]*)(.*)", re.DOTALL)
_LOADED = re.compile(r"loads\.\d+\.member")
_IN_COMMENT = re.compile(r"(?<=\[)[a-z_.]+(?=\])")


def present_key(key: str) -> str:
    """Present name of an earlier key, "" for a key without change."""
    for earlier, present in MOVES:
        rest = key[len(earlier) :]
        if key.startswith(earlier) and (not rest or rest[0] in "._["):
            return present + rest
    return ""


def earlier_keys(raw: Mapping[str, Any]) -> list[str]:
    """Keys of a case file that only an earlier version knew; none in a present file."""
    earlier = ["kind"] if "kind" in raw else []
    if _is_train(raw):
        return earlier
    earlier += [key for key in raw if key in _REMOVED or present_key(key)]
    drive = raw.get("drive")
    of_drive = [f"drive.{key}" for key in drive] if isinstance(drive, Mapping) else []
    return earlier + [key for key in of_drive if present_key(key)]


def refuse_earlier_file(raw: Mapping[str, Any], where: str) -> None:
    """Raise InputError for a file in an earlier form."""
    for key in earlier_keys(raw)[:1]:
        problem = "is of the form that cases had up to flexgear 0.2.0"
        raise InputError(where, key, problem, f"run flexgear upgrade {shlex.quote(where)}")
    several = raw.get("stages")
    stages = [*(several if isinstance(several, list) else ()), raw.get("stage")]
    rings = (stage.get("ring") for stage in stages if isinstance(stage, Mapping))
    if any(isinstance(ring, Mapping) and "gauges" in ring for ring in rings):
        remedy = 'write each as [[sensors]] with on = "…ring", measures = "strain", and grid_angle'
        raise InputError(where, "ring.gauges", "are sensors now", f"{remedy} for direction")


def refuse_earlier_key(key: str, where: str) -> None:
    """Raise InputError for an override with an earlier key, except for keys of the only stage,
    which may come without "stage."."""
    present = present_key(key)
    if present and present != f"stage.{key}":
        raise InputError(where, key, "is the name of a key up to 0.2.0", f"write {present}")


def upgraded(text: str, where: str) -> str:
    """The text of a case file converted to the present form, with its comments.

    Lines keep their order. Keys of removed sections are placed where the first of them was, or at
    the end of their present section. Raises InputError if a key is given by both its earlier and
    its present name, or in a form that cannot be moved.
    """
    raw = parse_toml(text, where)
    if not earlier_keys(raw):
        return text
    train = _is_train(raw)
    ports = {} if train else {p: m for p, m in _PORTS.items() if p.split(".")[0] not in raw}
    present_entries: dict[str, Any] = {f"{port}.member": member for port, member in ports.items()}
    for key, value in _leaves(raw):
        name = key if train else present_key(key) or key
        if name == key and key.partition(".")[0] in _REMOVED:
            raise InputError(where, key, "is not a known key", "correct it first")
        if name in present_entries:
            raise InputError(where, key, f"is given twice, also as {name}", "keep one of them")
        if key != "kind":
            bare = isinstance(value, str) and "." not in value and _LOADED.fullmatch(key)
            present_entries[name] = f"stage.{value}" if bare and not train else value
    first, *others = _blocks(text)
    first.body = [_Part(p.above) if p.path == ("kind",) else p for p in first.body]
    blocks = [first, *others] if train else _rewritten([first, *others], ports)
    remedy = "write sections under headers, each once and none in braces, and run this again"
    present, written = "", dict[str, Any]()
    for block in blocks:
        present += str(block)
        try:
            written = dict(_leaves(tomllib.loads(present)))
        except tomllib.TOMLDecodeError:
            raise InputError(where, block.path, "has no place in this file", remedy) from None
    for key in {**present_entries, **written}:
        if written.get(key) != present_entries.get(key):
            raise InputError(where, key, "has no place in this file", remedy)
    return present


def _is_train(raw: Mapping[str, Any]) -> bool:
    """Whether a file of an earlier version has the present form except for ``kind``."""
    return "stages" in raw or raw.get("kind") == "train"


def _leaves(data: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys and values of parsed TOML; list elements by index."""
    items = enumerate(data) if isinstance(data, list) else data.items()
    for name, value in items:
        key = f"{path}{name}"
        if isinstance(value, (dict, list)):
            yield from _leaves(value, f"{key}.")
        else:
            yield key, value


@dataclass(frozen=True)
class _Part:
    """A statement of a file with the comments directly above it. Blank lines, and comments that
    belong to no statement, have no path."""

    text: str
    path: tuple[str, ...] = ()
    above: str = ""

    def __str__(self) -> str:
        return self.above + self.text


@dataclass
class _Block:
    """A section of a file: header, keys and comments."""

    path: str
    header: _Part = _Part("")
    body: list[_Part] = field(default_factory=list)

    def __str__(self) -> str:
        return "".join(map(str, (self.header, *self.body)))


def _blocks(text: str) -> list[_Block]:
    """Divide a TOML file into its sections; headers in comments are renamed as well.

    A statement is the smallest number of lines that is valid TOML. Comments between a key and a
    header belong to neither.
    """
    blocks, pending, above = [_Block("")], "", ""
    for line in text.splitlines(keepends=True):
        pending += line if line.endswith("\n") else f"{line}\n"
        try:
            data = tomllib.loads(pending)
        except tomllib.TOMLDecodeError:
            continue
        statement, pending = pending, ""
        if statement.lstrip().startswith("#"):
            above += _IN_COMMENT.sub(_present_header, statement)
            continue
        body, is_header = blocks[-1].body, statement.lstrip().startswith("[")
        if data and not is_header:
            data = tomllib.loads(f"{statement.partition('=')[0]} = 0")
        path = tuple(_path_of(data))
        if above and (not path or (is_header and body and body[-1].path)):
            body.append(_Part(above))
            above = ""
        part, above = _Part(statement, path, above), ""
        if is_header:
            blocks.append(_Block(".".join(path), part))
        else:
            body.append(part)
    if above:
        blocks[-1].body.append(_Part(above))
    return blocks


def _path_of(data: Any) -> Iterator[str]:
    """Names of nested keys down to the only value."""
    while isinstance(data, dict) and data:
        ((name, data),) = data.items()
        yield name
        data = data[0] if isinstance(data, list) else data


def _rewritten(earlier: list[_Block], ports: Mapping[str, str]) -> list[_Block]:
    """Sections with present keys; ports: members of the ports that the file lacks."""
    targets: dict[str, _Block] = {}  # sections to which keys move, by path
    blocks = [block for each in earlier for block in _split(each, targets)]
    for port, member in ports.items():
        if port not in targets:
            blocks.append(targets.setdefault(port, _Block(port)))
        targets[port].body.insert(0, _Part(f'member = "{member}"\n', ("member",)))
    sections = {block.path: block for block in reversed(blocks) if block.header.text}
    for place, block in targets.items():
        header = place.removesuffix(".0")
        if header in sections:
            body = sections[header].body
            end = max((k for k, part in enumerate(body, 1) if str(part).strip()), default=0)
            body[end:end] = block.body
            block.body = []
        else:
            block.header = _Part(f"[[{header}]]\n" if header != place else f"[{place}]\n")
            block.body.append(_Part("\n"))
    return [block for block in blocks if block.header.text or block.body]


def _split(block: _Block, targets: dict[str, _Block]) -> list[_Block]:
    """A section with its present name, and the new sections to which its keys have moved. The new
    sections are also added to ``targets``."""
    section, header = present_key(block.path) or block.path, block.header
    stays, target = _Block(section, replace(header, text=_renamed(header.text, section))), None
    blocks, above = [stays], ""
    keys = [f"{block.path}.{'.'.join(part.path)}" for part in block.body if part.path]
    if removed := block.path in _SPLIT and all(map(present_key, keys)):
        written = _HEADER.fullmatch(header.text)  # its comments move with the first key
        above = header.above
        if written and written[5].strip():
            above += _IN_COMMENT.sub(_present_header, written[5])
        stays.header = _Part("")
    for part in block.body:
        full = ".".join(filter(None, (block.path, *part.path)))
        present = present_key(full) if part.path else ""
        if not present or present == f"{section}{full[len(block.path) :]}":
            body = stays.body if not removed or target is None else target.body
            if not removed or part.text.strip():
                body.append(_load(part) if full == "loads.member" else part)
            continue
        at, _, name = present.rpartition(".")
        if at not in targets:
            blocks.append(targets.setdefault(at, _Block(at)))
        target = targets[at]
        value = part.text[len(part.text.partition("=")[0].rstrip()) :]
        target.body.append(_Part(f"{name}{value}", (name,), above + part.above))
        above = ""
    if above:
        stays.body.append(_Part(above))
    return blocks


def _load(part: _Part) -> _Part:
    """The member of a load with its stage, which the earlier form could omit."""
    key, _, member = part.text.partition("=")
    full_name = re.sub(r"^(\s*[\"'])([^\"'.]+)(?=[\"'])", r"\1stage.\2", member)
    return replace(part, text=f"{key}={full_name}")


def _renamed(header: str, path: str) -> str:
    """The header with another path; its comment stays in its column if the path is short enough."""
    written = _HEADER.fullmatch(header)
    if written is None or written[2].strip() == path:
        return header
    start, earlier, end, gap, rest = written.groups()
    blanks = max(1, len(gap) + len(earlier) - len(path)) if gap else 0
    return f"{start}{path}{end}{' ' * blanks}{_IN_COMMENT.sub(_present_header, rest)}"


def _present_header(header: re.Match[str]) -> str:
    return present_key(header[0]) or header[0]
