"""The lab: many jobs over bags, programs and points, on all processors, the same again."""
