"""How right a picture is, and what that costs: comparison, convergence, quotes, studies, hard cases."""
