"""Test that the text of a script is read as LAMMPS reads it."""

import time

import pytest

from chaincor.lammps_inputs.commands import commands_of, words_of
from tests.lmp import run_lmp

# For each text, the lines that LAMMPS prints, one for each command that it executes.
TEXTS = {
    'print "one # two" # three': ["one # two"],
    'print \'a "# b" c\' # " d': ['a "# b" c'],
    'print """a # "b" """ # c': ['a # "b" '],
    'print "on&\ne"': ["one"],
    "print one & \n  # it goes on\nprint two": ["one", "two"],
    '# no &\nprint "none"\nprint "one"': ["one"],
    'print "one" # no &\nprint "none"': ["one"],
    '# """\nprint "none"\n# """\nprint "one"': ["one"],
    "variable a string it's # all of it\nprint one": None,
}


@pytest.mark.parametrize("text", TEXTS)
def test_comments_quotes_and_continued_lines_are_lammps_own(text, tmp_path):
    (tmp_path / "in.chain").write_text(f"echo none\nprint begin\n{text}\n")
    done = run_lmp(tmp_path)
    commands = commands_of(text)
    if TEXTS[text] is None:
        # Here, # begins no comment, so that the command has too many words.
        assert done.returncode != 0
        assert commands[0].endswith("# all of it")
        return
    log = (tmp_path / "log.lammps").read_text()
    said = log.partition("begin\n")[2].partition("Total wall time")[0].splitlines()
    assert said == TEXTS[text]
    assert len(commands) == len(said)
    assert all(word in command for word, command in zip(said, commands, strict=True))


# For each text, the lines that an `if` command prints.
CARRIED_OUT = {
    '"print a" \'print "b"\' """print "c \'d\'" """': ["a", "b", "c 'd'"],
    '"print a\\" "print b" "print c\\"': ["a\\", "b", "c\\"],
}


@pytest.mark.parametrize("text", CARRIED_OUT)
def test_words_in_quotes_are_lammps_own(text, tmp_path):
    command = f"if 1 then {text}"
    (tmp_path / "in.chain").write_text(f"echo none\nprint begin\n{command}\n")
    log = run_lmp(tmp_path).stdout
    said = log.partition("begin\n")[2].partition("Total wall time")[0].splitlines()
    assert said == CARRIED_OUT[text]
    inner = [words_of(word) for word in words_of(command)[3:]]
    assert all(words[0] == "print" for words in inner)
    assert [" ".join(words[1:]) for words in inner] == said


@pytest.mark.parametrize("text", ['print "one', "print 'one", 'print """one"'])
def test_a_quote_that_never_ends_is_an_error_to_lammps_too(text, tmp_path):
    (tmp_path / "in.chain").write_text(f"{text}\n")
    assert "Unmatched" in run_lmp(tmp_path).stdout
    with pytest.raises(ValueError, match="never ends"):
        words_of(text)


@pytest.mark.parametrize("line", ["fix 1 all nve", 'print "a b"'])
def test_quotes_that_never_end_take_no_longer_than_the_text(line):
    text = 'print """\n' + f"{line}\n" * 20_000
    begin = time.process_time()
    (command,) = commands_of(text)
    # This takes 0.1 s. It would take 17 s if the text were searched again for each line.
    assert time.process_time() - begin < 5.0
    assert command.endswith(line)
