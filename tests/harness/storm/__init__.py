"""Random commands on every interface and random faults, judged by what both sides really did."""
