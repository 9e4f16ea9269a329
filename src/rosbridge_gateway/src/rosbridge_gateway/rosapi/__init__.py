"""The services of rosapi, answered by the gateway."""
