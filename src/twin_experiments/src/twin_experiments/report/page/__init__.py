"""The HTML page of a report: one file, images, data and chart library inside."""
