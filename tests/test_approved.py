"""Everything that the command line prints and writes, held to what was read and approved.

See ``approve.py`` for how to approve a change, ``approval_commands`` for what is run.
"""

import click
import pytest
from approval_commands import COMMANDS
from approval_compare import agrees, differences
from approve import EVERY, approved, recorded

from sssfit.cli import cli

EACH = [(group, each) for group, several in EVERY.items() for each in several]


@pytest.mark.parametrize(
    ("group", "command"), EACH, ids=[f"{group}: {command.title}" for group, command in EACH]
)
def test_it_does_what_was_approved(group, command):
    expected = approved(group).get(command.title)
    assert expected is not None, (
        f"nothing is approved for this; run python tests/approve.py {group}, read what it recorded "
        f"in tests/approved/{group}.txt, and commit it"
    )
    if found := differences(recorded(command), expected):
        pytest.fail(
            "\n".join(
                [
                    f"$ {command.title}",
                    *found,
                    f"If this is right: python tests/approve.py {group}, read the difference, "
                    "commit it.",
                ]
            ),
            pytrace=False,
        )


@pytest.mark.parametrize("group", EVERY)
def test_nothing_is_approved_that_is_not_run(group):
    titles = [command.title for command in EVERY[group]]
    assert len(set(titles)) == len(titles)
    assert list(approved(group)) == titles


def test_every_option_of_every_verb_is_run():
    """In both spellings where it has two, at least one of them."""
    lines = [each.line.split() for several in COMMANDS.values() for each in several]
    missing = [
        f"{verb} {option.opts[-1]}"
        for verb, command in cli.commands.items()
        for option in command.params
        if isinstance(option, click.Option)
        and not any(line[:1] == [verb] and set(option.opts) & set(line) for line in lines)
    ]
    assert missing == []


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        ("R 0.123457 of 3", "R 0.123458 of 3"),
        ("[0.12345678901234]", "[0.12345678901239]"),
        ("[0.5]", "[0.49999999999999994]"),
        ("1e-17 left", "-3.2e-17 left"),
        ("sum -0.002276427671", "sum -0.002276427669"),
        ("12,345.6", "12,345.7"),
    ],
)
def test_rounding_agrees(found, expected):
    assert agrees(found, expected)


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        ("3 terms", "4 terms"),
        ("svd3", "svd4"),
        ("0.3 mm", "0.4 mm"),
        ("1.2 %", "1.3 %"),
        ("0.123457", "0.12346"),
        ("0.123457", "0.123459"),
        ("[0.123457]", "[0.12345678901234]"),
        ("[0.1234567890]", "[0.1234569890]"),
        ("10,000 photons", "10,001 photons"),
        ("12000", "12001"),
        ("a  1.25", "a 1.25"),
        ("1.25", "1.25 %"),
        ("0.5, 0.25", "0.25, 0.5"),
        ("sha256 28ebc560c4aade9d", "sha256 28ebc560c4aade9e"),
        ("1e-05", "1e-06"),
        ("-0.25", "0.25"),
    ],
)
def test_faults_do_not_agree(found, expected):
    assert not agrees(found, expected)
