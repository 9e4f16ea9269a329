"""What a delivered controller needs, on paper and over the wire, from the doctor's own tables."""
