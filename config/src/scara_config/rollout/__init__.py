"""Changes of a cell's configuration that come from elsewhere and hold from the next start on."""
