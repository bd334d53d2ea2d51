"""How right a picture is, and what that costs: comparison, convergence, quotes, studies, a self-test."""
