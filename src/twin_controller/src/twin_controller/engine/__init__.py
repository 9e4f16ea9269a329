"""The core at work: inputs in their order, one step after the other, effects to both links."""
