"""The HTML page of a report: one file, images, data and chart library in it, no request outside."""
