"""How the stand-in moves and answers: what differs from one real robot to another."""
