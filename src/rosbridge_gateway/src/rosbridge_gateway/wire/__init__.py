"""What goes over the web socket: JSON, CBOR, PNG, fragments."""
