"""The bridge between the real robot and its twin: links, arbitration, safety, recorder."""
