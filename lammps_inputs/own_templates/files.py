"""Find words of LAMMPS commands that name files outside a job's folder, or a job's own files."""

import itertools
import re

# Files that a job writes or reads. A template that wrote one of them could add commands to the job.
_OF_JOB = (
    *("in.chain", "chain.data", "chain.state", "chain.restart", "bond.table", "scene.toml"),
    *("asked.toml", "units.toml", "log.lammps", "contacts.txt"),
)
# Position of the first word that names an output, by command.
_OUTPUT_AT = {
    **dict.fromkeys(("write_data", "write_restart", "write_coeff", "log", "group2ndx"), 1),
    "write_dump": 3,
    "dump": 5,
    "restart": 2,
}
# Words before the name of an output, in options of other commands.
_BEFORE_OUTPUT = ("file", "append", "overwrite")
# Position of the text that a command prints, which names no file.
_TEXT_AT = {"print": 1, "fix": 5}
_SUBSTITUTED = re.compile(r"\$(\{\w*\}|\([^)]*\)|\w)")
_PLAIN = re.compile(r"\w[\w./*%+=,@-]*", re.ASCII)
# LAMMPS passes names with these endings to a shell.
_COMPRESSED = re.compile(r".*\.(gz|bz2|zst|xz|lzma|lz4|Z)", re.DOTALL)
_INSIDE = "a job uses only files in its own folder"


def wrong_file(words: list[str]) -> str | None:
    """Return why a job must not use a file that a command names; None if it may."""
    first, rest = "".join(words[:1]), list(words)
    prints = first == "print" or (first == "fix" and words[3:4] == ["print"])
    if prints:
        del rest[_TEXT_AT[first] : _TEXT_AT[first] + 1]
    if first in ("if", "run"):  # The commands that they quote are checked one by one.
        return None
    for word in rest[1:]:
        if re.match(r"[/~|]", word) or ".." in re.split(r"[/\s]", word):
            return _INSIDE
        if _COMPRESSED.fullmatch(word) and not _PLAIN.fullmatch(_SUBSTITUTED.sub("", word)):
            return _INSIDE
        if first == "variable" and word.removeprefix("./") in _OF_JOB:
            return "its value names a file of the job"
    outputs: list[str] = []
    if first in _OUTPUT_AT:
        outputs = rest[_OUTPUT_AT[first] :][: None if first == "restart" else 1]
    if first in ("print", "fix", "info"):
        options = rest[1 if first != "fix" else 4 :]
        pairs = itertools.pairwise(["", *options])
        named = [word for before, word in pairs if before in _BEFORE_OUTPUT]
        if prints and any("$" in word for word in options if word not in named):
            return "its options must not contain a variable"
        outputs += named
    if first == "log" and outputs in (["none"], ["log.lammps"]):
        return None
    return next(filter(None, map(_wrong_output, outputs)), None)


def _wrong_output(word: str) -> str | None:
    """Return why a job must not write a file with this name; None if it may."""
    name = word.removeprefix("./")
    literal, dollar, _ = name.partition("$")
    if not _PLAIN.fullmatch(literal) or not re.fullmatch(
        r"[\w./*%+=,@-]*", _SUBSTITUTED.sub("", name)
    ):
        return "the name of its file must begin with a letter or digit and contain no other signs"
    if name in _OF_JOB or (dollar and any(own.startswith(literal) for own in _OF_JOB)):
        return "its output would replace a file of the job"
    return None
