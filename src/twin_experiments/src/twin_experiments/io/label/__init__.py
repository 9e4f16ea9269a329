"""What the reporting machine and its workspace say of themselves."""
