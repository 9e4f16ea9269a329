"""The journal of a cell: its entries, what they are made from, and how they are told."""
