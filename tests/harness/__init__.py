"""What tests need to start and end real processes: own master, own ports, own logs, nothing left behind."""
