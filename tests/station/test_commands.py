"""The command line: every command is there, and none loads what another needs."""

import subprocess
import sys
from pathlib import Path

import pytest

import station.bench.__main__ as bench
from alight.markers.layout import shipped_layouts
from station.__main__ import COMMANDS, main, parser

REPOSITORY = Path(__file__).parents[2]
RECORDING = REPOSITORY / "tests" / "replay" / "flights" / "descent.mcap"
SPEC = REPOSITORY / "station" / "campaign" / "examples" / "thousand.toml"

NAMES = [command.name for command in COMMANDS]


def loaded_by(*words: str) -> set[str]:
    """The modules that a fresh process has after a command's help."""
    program = (
        "import sys; from station.__main__ import main\n"
        f"try: main({[*words, '--help']!r})\n"
        "except SystemExit: pass\n"
        "print('LOADED', *sys.modules)"
    )
    said = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    return set(said.split("LOADED")[1].split())


@pytest.mark.parametrize("name", NAMES)
def test_the_help_of_each_command_says_what_it_is_for(name, capsys) -> None:
    with pytest.raises(SystemExit) as ended:
        main([name, "--help"])
    assert ended.value.code == 0
    meaning = next(command.meaning for command in COMMANDS if command.name == name)
    assert meaning[1:30] in capsys.readouterr().out


@pytest.mark.parametrize("action", ["show", "print"])
def test_the_help_of_a_pad_names_every_shipped_layout(action, capsys) -> None:
    with pytest.raises(SystemExit):
        main(["pad", action, "--help"])
    said = capsys.readouterr().out
    assert [name for name in shipped_layouts() if f"`{name}`" not in said] == []


@pytest.mark.parametrize("words", [["--help"], ["-h"], ["geodesy", "--help"]])
def test_the_help_of_the_benches_lists_them(words, monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "argv", ["bench", *words])
    assert bench.main() == 0
    said = capsys.readouterr().out
    assert all(f"\n  {name} " in said for name in bench.BENCHES)


def test_a_command_that_is_not_asked_for_is_named_but_not_loaded(capsys) -> None:
    modules = {command.module for command in COMMANDS}
    assert not modules & loaded_by("abort")
    assert modules & loaded_by("pad") == {"station.pad.command"}
    parser([]).print_help()
    said = capsys.readouterr().out
    assert all(f"    {name}" in said for name in NAMES)


@pytest.mark.parametrize(
    ("words", "option"),
    [
        (["fly", "--lockstep"], "--out"),
        (["campaign", str(SPEC)], "--out"),
        (["replay", str(RECORDING), "--through", "filter"], "--report"),
        (["calibrate", "bias", str(RECORDING)], "--out"),
    ],
    ids=lambda words: words[0],
)
def test_a_folder_that_cannot_be_written_is_told_at_once(words, option, tmp_path, capsys) -> None:
    (tmp_path / "file").touch()
    folder = tmp_path / "file" / "below"
    assert main([*words, option, str(folder)]) != 0
    said = capsys.readouterr()
    assert (
        said.err.endswith(f": {option} {folder}: Not a directory: choose another folder\n")
        and said.err.count("\n") == 1
    )


@pytest.mark.parametrize(
    "words",
    [["report"], ["recording", "info"], ["recording", "repair"], ["recording", "migrate", "--out", "unwritten.mcap"]],
)
@pytest.mark.parametrize(
    ("content", "reason"),
    [(None, "no such recording"), (b"no", "not an MCAP recording"), (b"no recording at all", "not an MCAP")],
)
def test_what_is_no_recording_is_said_by_the_command_in_plain_words(
    words, content, reason, tmp_path, monkeypatch, capsys
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "text.mcap"
    if content is not None:
        path.write_bytes(content)
    assert main([*words, str(path)]) != 0
    said = capsys.readouterr().err
    named = " ".join(words[:2]) if words[0] == "recording" else words[0]
    assert said.startswith(f"alight {named}: {path}: {reason}") and said.count("\n") == 1
    assert "buffer" not in said and "()" not in said


@pytest.mark.parametrize("start", ["1,2", "1,2,3,4", "here", ""])
def test_a_start_that_is_no_place_is_told_with_an_example(start, capsys) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["fly", "--start", start])
    assert ended.value.code == 2
    assert f"--start: {start!r}: write N,E,D in metres, such as 10,10,-20" in capsys.readouterr().err
