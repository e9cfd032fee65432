"""Every command: an example that runs at the end of its help, hints, warnings of one line, completion, older clicks."""

import importlib
import shlex
import subprocess
import sys
from pathlib import Path

import click
import pytest

from studies import cli
from studies.cli import build, main

ROOT = Path(__file__).parents[2]
# seconds to hours; explore serves until it is interrupted
DEAR = {"run", "tyre fit", "uncertainty", "diagnose", "animate", "explore"}
NEEDS_FILES = {"look", "sweep", "modal", "frequency-response", "tyre fit", "rider", "forces"}  # of the user


def commands(group: click.Group, path: tuple[str, ...] = ()):
    yield path, group
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if isinstance(command, click.Group):
            yield from commands(command, (*path, name))
        else:
            yield (*path, name), command


def examples(command: click.Command) -> list[str]:
    lines = [line.strip() for line in (command.epilog or "").splitlines()]
    return [line for line in lines if line.startswith("velotyre ")]


EVERY = {" ".join(path): command for path, command in commands(build())}


@pytest.mark.parametrize("name", EVERY)
def test_the_help_ends_with_an_example(name, capsys):
    main([*name.split(), "--help"])
    lines = [line for line in capsys.readouterr().out.splitlines() if line.strip()]
    assert "Example" in " ".join(lines)
    assert lines[-1].startswith(("    velotyre ", "  velotyre "))
    assert all(line.split()[1] in cli.build().list_commands(None) for line in examples(EVERY[name]))
    if name and not isinstance(EVERY[name], click.Group):
        assert any(line.startswith(f"velotyre {name} ") or line == f"velotyre {name}" for line in examples(EVERY[name]))


# imperatives with which the help of a command may start
VERBS = {
    "Add",
    "Assess",
    "Compute",
    "Convert",
    "Draw",
    "Estimate",
    "Film",
    "Find",
    "Fit",
    "List",
    "Open",
    "Propagate",
    "Rank",
    "Show",
    "Simulate",
    "Study",
    "Write",
}
LONGEST = 54  # letters, which `velotyre --help` shows next to the longest name of a command


@pytest.mark.parametrize("name", EVERY)
def test_the_help_starts_with_a_verb_in_a_sentence_that_is_shown_in_full(name):
    paragraph = " ".join((EVERY[name].help or "").split("\n\n")[0].split())
    first = paragraph.partition(". ")[0].removesuffix(".") + "."
    assert first.split()[0] in VERBS
    assert len(first) <= LONGEST
    assert "?" not in EVERY[name].help


@pytest.mark.parametrize("name", [name for name, command in EVERY.items() if isinstance(command, click.Group)])
def test_the_list_of_commands_cuts_none_off(name, capsys):
    main([*name.split(), "--help"])
    shown = capsys.readouterr().out.partition("Commands:")[2].partition("Example")[0]
    assert shown.strip()
    assert "..." not in shown
    assert all(line.endswith(".") for line in shown.splitlines() if line.strip())


@pytest.mark.parametrize("name", EVERY)
def test_the_help_of_an_option_is_a_sentence(name):
    for option in (one for one in EVERY[name].params if isinstance(one, click.Option) and not one.hidden):
        words = (option.help or "").removesuffix("]").partition(" [default: ")[0]
        assert words[:1].isupper() or words.startswith("NAME"), (option.opts, words)
        assert words.endswith("."), (option.opts, words)


BESIDE = tuple(f"velotyre {name}" for name in DEAR | NEEDS_FILES)
EVERY_LINE = {line for command in EVERY.values() for line in examples(command)}
CHEAP = sorted(line for line in EVERY_LINE if not line.startswith(BESIDE) and "model.toml" not in line)


@pytest.mark.parametrize("line", CHEAP)
def test_the_example_runs_as_it_stands(no_pictures, line, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    main(shlex.split(line)[1:])
    shown = capsys.readouterr()
    assert shown.out.strip()
    assert all(len(part.split(":")) > 1 for part in shown.err.splitlines())  # remarks and warnings, one a line


def test_every_command_that_warns_takes_verbose():
    for file in (ROOT / "studies" / "commands").rglob("*.py"):
        text = file.read_text(encoding="utf-8")
        if "print_warnings(" in text:
            name = " ".join(file.relative_to(ROOT / "studies" / "commands").with_suffix("").parts).replace("_", "-")
            assert "--verbose" in [option for p in EVERY[name].params for option in p.opts], name


def test_notes_on_a_tyre_are_one_line_and_verbose_shows_them(capsys):
    asked = ["critical", "pista_charlie_drops", "--tyre", "Tyre1", "--pressure", "6.2"]
    main(asked)
    line, rigid = capsys.readouterr().err.splitlines()
    assert rigid.startswith("note: the front frame is rigid")
    assert line == (
        "note: Tyre1 on flat (rear 442 N, 6.2 bar, interpolated; front 426 N, 6.2 bar, interpolated): "
        "4 notes, --verbose shows them"
    )
    main([*asked, "--verbose"])
    full = capsys.readouterr().err.splitlines()
    assert len(full) == 4 + 1
    assert any("lateral stiffness between measured conditions: bilinear" in line for line in full)
    assert all(line.startswith("note: ") for line in full)
    main([*asked[:-1], "9"])
    assert capsys.readouterr().err.startswith("warning: Tyre1 on flat (rear 442 N, 9 bar, extrapolated")


def test_an_unknown_command_is_refused_with_the_nearest(refused):
    (line,) = refused("critcal", "benchmark").splitlines()
    assert "unknown command 'critcal'; did you mean 'critical'? known: amplitude, animate, " in line
    assert "unknown command 'fitt'; did you mean 'fit'?" in refused("tyre", "fitt")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_prints_a_script(shell, monkeypatch, capsys):
    monkeypatch.setattr("click.shell_completion.BashComplete._check_version", staticmethod(lambda: None))  # asks bash
    monkeypatch.setenv("_VELOTYRE_COMPLETE", f"{shell}_source")
    with pytest.raises(SystemExit):
        main([])
    assert f"_VELOTYRE_COMPLETE={shell}_complete" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "place", "expected"), [("velotyre crit", "1", "critical"), ("velotyre critical fish", "2", "fisher")]
)
def test_completion_knows_commands_and_packaged_bicycles(words, place, expected, monkeypatch, capsys):
    for name, value in (("_VELOTYRE_COMPLETE", "bash_complete"), ("COMP_WORDS", words), ("COMP_CWORD", place)):
        monkeypatch.setenv(name, value)
    with pytest.raises(SystemExit):
        main([])
    assert expected in capsys.readouterr().out


def test_an_older_click_without_the_exception_of_the_help_page(monkeypatch, capsys):
    monkeypatch.delattr(click.exceptions, "NoArgsIsHelpError", raising=False)
    older = importlib.reload(cli)
    try:
        assert older.NO_ARGUMENTS == ()
        with pytest.raises(SystemExit):
            older.main(["critical"])
        assert "Missing argument 'MODEL'" in capsys.readouterr().err
    finally:
        monkeypatch.undo()
        importlib.reload(cli)


def test_no_command_shows_the_commands(printed):
    assert "Commands:" in printed()


@pytest.mark.parametrize("length", [300, 5000])
def test_a_long_word_is_not_echoed_in_full(length, refused):
    (said,) = refused("critical", "./" + "x" * (length - 2)).splitlines()
    assert max(map(len, said.split())) <= 401  # a colon may follow
    assert ("..." in said) == (length == 5000)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_under_the_output_is_one_line():
    with Path("/dev/full").open("w") as full:
        program = "from studies.cli import main; main(['list'])"
        done = subprocess.run(
            [sys.executable, "-c", program], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 2
    assert done.stderr.splitlines()[0] == "velotyre: the output cannot be written: No space left on device"


@pytest.mark.skipif(sys.platform == "win32", reason="a folder in use cannot be removed")
def test_a_current_folder_that_is_gone_is_one_line(tmp_path):
    """As of a shell that stands in a folder which was made anew: no path can be found from there."""
    program = "import os\nos.rmdir(os.getcwd())\nfrom studies.cli import main\nmain(['look', '/nowhere/a.tdms'])"
    (gone := tmp_path / "gone").mkdir()
    process = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(ROOT)!r})\n{program}"],
        cwd=gone, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert process.returncode == 2
    assert process.stderr == "velotyre: the current folder is not there any more; change to one that is\n"


def test_a_reader_who_has_seen_enough_is_no_error():
    command = [sys.executable, "-c", "from studies.cli import main; main(['list'])"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        running.stdout.close()
        assert not running.stderr.read()


def test_commands_on_a_tyre_have_the_option_that_its_refusal_names():
    for path, command in commands(build()):
        options = {name for parameter in command.params for name in parameter.opts}
        if "--tyre" in options and path not in {("new",), ("run",)}:  # they read no table beyond its range
            assert "--extrapolate" in options, path
