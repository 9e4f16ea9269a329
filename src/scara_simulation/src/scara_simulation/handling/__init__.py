"""Rules of handling: when the suction holds, what a touch means, when a part was dropped. Pure."""
