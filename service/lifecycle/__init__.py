"""How renders, jobs and steps begin, pause, share and end: rows, clocks and fairness."""
