"""HTTP routes. They validate, compile and price scenes; they never render them."""
