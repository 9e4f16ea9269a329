"""Streamed set points: what a packet must fulfil, and the stream of them."""
