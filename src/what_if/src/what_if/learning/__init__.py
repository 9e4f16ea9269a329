"""What was predicted beside what happened."""
