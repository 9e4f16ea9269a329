"""What every link to a robot shares, whatever its protocol: commands out, checked samples in."""
