from benchmarks import machine


def test_several_runs_are_told_by_their_median_and_their_ends() -> None:
    told = machine.spread([3.0, 1.0, 2.0])
    assert told == {"median": 2.0, "least": 1.0, "most": 3.0, "runs": 3}


def test_a_figure_says_where_it_was_measured() -> None:
    described = machine.describe()
    assert described["cores"] >= 1
    assert described["cpu"]
    assert described["date"].endswith("+00:00")
