"""Who asks: API keys, sessions of browsers, and what each user may do."""
