"""Who may move the pair: one holder of control, whom others ask for it."""
