"""Questions of the lessons: read off a text, guessed at, answered; bad ones are refused."""

from pathlib import Path
from types import SimpleNamespace

import pytest

import _page
from taichi_dem import InputError
from tests.scenes import ROOT

FOLDER = Path(ROOT) / "experiments" / "lessons"
TEXT = """
Why is
it so? :: as ever | *it is
so :: It is **so**:
as it is.

And then? :: *nothing | much | more :: Nothing.
"""


def test_questions_guesses_and_answers_are_read_off_a_text():
    first, second = _page.questions(TEXT)
    assert first == (
        "Why is it so?",
        ("as ever", "it is so"),
        "it is so",
        "It is **so**: as it is.",
    )
    assert second.guesses == ("nothing", "much", "more") and second.right == "nothing"


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("Why? :: Nothing.", "must read"),
        ("Why? :: a | *b :: c :: d", "must read"),
        ("Why? ::  :: c", "must read"),
        ("Why? :: a | b :: c", "'Why\\?' must have one right guess, with a star, got 0"),
        ("Why? :: *a | *b :: c", "'Why\\?' must have one right guess, with a star, got 2"),
        ("Why? :: *a :: c", "two to four different guesses, got '\\*a'"),
        ("Why? :: *a | b | c | d | e :: f", "two to four different guesses"),
        ("Why? :: *a | a :: b", "two to four different guesses"),
        ("Why? :: *a | :: b", "two to four different guesses"),
    ],
)
def test_a_malformed_question_is_refused_in_a_sentence(text, word):
    with pytest.raises(InputError, match=word) as told:
        _page.questions(f"Good? :: *yes | no :: Yes.\n\n{text}")
    assert "\n" not in str(told.value)


def test_an_answer_stands_there_only_after_its_guess():
    """And says whether the guess was right; the other question keeps its answer back."""
    shown = SimpleNamespace(md=str, callout=str, vstack=lambda rows, **_: rows)
    asked = _page.questions(TEXT)
    for guess, verdict in (("it is so", "**Right.**"), ("as ever", "**Not so, but: *it is so*.**")):
        buttons = SimpleNamespace(elements=["first", "second"], value=[guess, None])
        _, *rows = _page.replies(shown, asked, buttons)
        assert rows == ["first", f"{verdict} It is **so**: as it is.", "second"]


@pytest.mark.parametrize("path", sorted(FOLDER.glob("wh*.py")), ids=lambda path: path.stem)
def test_every_lesson_asks_and_its_right_guesses_have_no_common_place(path):
    """Each notebook is at most 100 lines long."""
    source = path.read_text(encoding="utf-8")
    assert len(source.splitlines()) <= 100
    text = source.split('asked = questions("""')[1].split('"""')[0]
    asked = _page.questions(text)
    assert len(asked) >= 5
    assert len({question.guesses.index(question.right) for question in asked}) > 1
