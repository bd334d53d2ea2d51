from benchmarks import machine


def test_a_figure_says_where_it_was_measured() -> None:
    described = machine.describe()
    assert described["cores"] >= 1
    assert described["cpu"]
    assert described["date"].endswith("+00:00")
