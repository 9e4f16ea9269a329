"""$SNPX_ASG: which variable of the controller stands at which register address."""
