"""Handing out work: the dispatcher, its transactions, and which server leads."""
