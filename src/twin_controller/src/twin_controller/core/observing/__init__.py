"""What the samples of both sides mean: clocks, changes, echoes, divergence."""
