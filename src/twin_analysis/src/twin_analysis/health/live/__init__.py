"""The monitor beside a running cell: it takes cycles as they end and keeps the first week."""
