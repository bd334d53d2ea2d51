import tomllib

from tools.check_words import LIST, found


def test_a_listed_word_is_found_with_its_line_and_what_to_write_instead() -> None:
    words = tomllib.loads(LIST.read_text())
    text = "All is well.\nThe job Stands still.\nA hero's wishlist."
    assert found(words, text) == [(2, "Stands still", words["(?:stand|stands|standing|stood) still"])]
