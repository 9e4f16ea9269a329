"""Error figures of a run: path error, lag, positioning error."""
